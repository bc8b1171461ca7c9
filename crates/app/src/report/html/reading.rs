//! How the page is read.

use super::super::data::Run;
use super::blocks::section;

/// The words that the page uses, explained.
pub(super) fn how_to_read(page: &mut String, run: &Run) {
    section(page, "How to read this");
    page.push_str("<ul>");
    if run.driven.is_some() {
        page.push_str(DRIVEN);
    }
    page.push_str(ALWAYS);
    if !run.rows.is_empty() {
        page.push_str(FELT);
    }
    page.push_str("</ul>\n");
}

const DRIVEN: &str = "\
<li><b>The part's own curve</b>: the held body is driven along its path in small steps of travel, as in a testing \
machine, in and out again. Neither a speed nor a hand is in it. The <b>verdict</b> comes from it: a part \
<b>snaps</b> if the force passes a peak and falls by at least a tenth of it while the body moves on. A force that \
grows until the way ends is the <b>seat</b>, not the snap.</li>\
<li><b>Snap ratio</b> is the fall over the peak. <b>Work</b> is the largest value of the integral of force over \
travel: what must be put in to get past.</li>";

const ALWAYS: &str = "\
<li><b>Peak</b> is the largest force that is passed while pushing in; <b>snap drop</b> is how far the force falls \
after it. A drop larger than the peak means that the part pulls the tool in. People tell two \
forces apart when they differ by 7 to 10 %.</li>\
<li><b>Certificate</b> is the largest violation of the contact conditions in any step: no contact \
pulls, no node is inside the tool, no force without touch; scaled so that 1 is as large as the \
forces and gaps themselves.</li>\
<li><b>Strain</b> tells whether the material stays elastic: compare with its permissible strain, and mind the bar, \
which is the mesh's error. \
<b>Rotation</b> tells whether small displacements are a fair assumption: see the effect \
<i>large_rotation</i>.</li>\
<li>In the pictures the shape is to scale. Colours reach from zero to the top of the scale, the same \
in every picture of this run. Stress at contact points and clamped edges depends on the fineness of \
the mesh: read it away from them.</li>";

const FELT: &str = "\
<li>The hand feels the part through a spring, the <b>virtual coupling</b>. A soft coupling rounds \
the peak and stretches the drop, as a soft grip does. <b>Snap travel</b> is the way from the felt peak to the point \
where the force is gone. The shorter it is, the crisper the snap.</li>\
<li><b>Imbalance</b> is by how much the force of the contacts on the tool differs from that of the coupling, as a \
share of it.</li>\
<li><b>p99</b> is the time that 99 % of the steps did not exceed. A hand notices the slow ones, so \
the mean is not shown.</li>";
