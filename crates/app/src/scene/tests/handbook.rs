//! `[handbook]`: what does not belong to a kind or makes no sense in it.

use super::*;

#[test]
fn refusals_name_line_key_and_mend() {
    refuses([
        (
            adding(
                "[handbook]\nlength = 0.02\nthickness = 0.002\nwidth = 0.006\nundercut = 0.001\nlead_angle_deg = 90\nfriction = 0\n",
            ),
            "clip.toml:26: lead_angle_deg 90 must be below 90; ramps have 20 to 45",
        ),
        (
            adding(
                "[handbook]\nlength = 0.02\nthickness = 0.002\nwidth = 0.006\nundercut = 0.001\nlead_angle_deg = 70\nfriction = 0.5\n",
            ),
            "clip.toml:27: friction 0.5 locks a ramp of 70 degrees; friction times tan(lead angle) must be below 1",
        ),
        (
            adding("[handbook]\nkind = \"annular\"\nthickness = 0.001\nlength = 0.02\n"),
            "clip.toml:24: length does not belong to kind \"annular\"; remove it; its own keys: thickness, share, undercut, lead_angle_deg, edge_radius, return_angle_deg, diameter, bead_height, from_end",
        ),
        (
            adding("[handbook]\nkind = \"ring\"\nthickness = 0.001\n"),
            "clip.toml:21: kind \"ring\" needs opening_deg in [handbook]; add `opening_deg = ...`",
        ),
        (
            adding(
                "[handbook]\nthickness = 0.002\nlength = 0.02\nwidth = 0.006\nundercut = 0.001\nlead_angle_deg = 30\nshare = 2\n",
            ),
            "clip.toml:27: share 2 is more than the whole joint; write 1 for a whole joint, 0.5 for half of it, 0.25 for a quarter",
        ),
        (
            adding(
                "[handbook]\nkind = \"ring\"\nthickness = 0.001\nwidth = 0.01\nradius = 0.0101\nopening_deg = 170\n",
            ),
            "clip.toml:14: rod_radius 0.01 passes the opening untouched; radius sin(opening_deg / 2) must be below it",
        ),
        (
            adding(
                "[handbook]\nkind = \"ring\"\nthickness = 0.001\nwidth = 0.01\nradius = 0.0101\nopening_deg = 100\nroot_angle_deg = 140\n",
            ),
            "clip.toml:27: root_angle_deg 140 leaves no arm before the lip at 130; both count from the foot's middle",
        ),
        (
            adding(
                "[handbook]\nkind = \"annular\"\nthickness = 0.001\ndiameter = 0.02\nundercut = 0.0002\nlead_angle_deg = 80\nbead_height = 0.001\n",
            ),
            "clip.toml:26: a ramp of 80 degrees closes this bead; the formula has no answer for so high a bead on so steep a ramp: lower one of them",
        ),
    ]);
}
