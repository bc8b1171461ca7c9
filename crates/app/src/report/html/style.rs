//! Looks of the page.

/// The page's style sheet: readable on a screen, printable, no fonts or pictures from elsewhere.
pub(crate) const STYLE: &str = "
:root { --ink: #1e2126; --soft: #5b6470; --line: #d9dee4; --paper: #fff; --tint: #f4f6f8; --accent: #0072b2; --alarm: #b34700; --alarm-tint: #fdf3ec; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--tint); color: var(--ink); font: 16px/1.5 system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 32px 40px 64px; background: var(--paper); }
h1 { font-size: 30px; line-height: 1.2; margin: 0 0 4px; }
h2 { font-size: 20px; margin: 44px 0 12px; padding-bottom: 6px; border-bottom: 1px solid var(--line); }
p { margin: 8px 0; max-width: 78ch; }
.where { color: var(--soft); font-size: 14px; margin: 0; overflow-wrap: anywhere; }
.headline { font-size: 21px; line-height: 1.45; margin: 24px 0 16px; padding: 16px 20px; background: var(--tint); border-left: 5px solid var(--accent); max-width: none; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 12px; margin: 16px 0; }
.card { border: 1px solid var(--line); border-radius: 6px; padding: 10px 14px; }
.card b { display: block; font-size: 23px; font-weight: 600; font-variant-numeric: tabular-nums; }
.card span { color: var(--soft); font-size: 14px; }
.warning { border-left: 5px solid var(--alarm); background: var(--alarm-tint); padding: 8px 16px; max-width: none; }
svg { max-width: 100%; height: auto; display: block; }
table { border-collapse: collapse; margin: 12px 0; font-size: 15px; }
th, td { text-align: left; padding: 5px 18px 5px 0; border-bottom: 1px solid var(--line); vertical-align: top; }
th { color: var(--soft); font-weight: 600; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr.sum td { font-weight: 600; }
.scroll { overflow-x: auto; }
figure { margin: 0; }
figure img { width: 100%; height: auto; display: block; border: 1px solid var(--line); }
figcaption { font-size: 14px; color: var(--soft); padding: 4px 0 14px; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(460px, 1fr)); gap: 8px 16px; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 4px 24px; font-size: 15px; }
dt { color: var(--soft); } dd { margin: 0; overflow-wrap: anywhere; }
li { margin: 6px 0; max-width: 78ch; }
footer { margin-top: 48px; color: var(--soft); font-size: 14px; }
@media (max-width: 700px) { main { padding: 20px 16px; } .pictures { grid-template-columns: 1fr; } dl { grid-template-columns: 1fr; } dt { margin-top: 6px; } }
@media screen and (prefers-color-scheme: dark) { :root { --ink: #e4e7eb; --soft: #a3acb8; --line: #3a414b; --paper: #191c21; --tint: #23272e; --accent: #56b4e9; --alarm: #e69f00; --alarm-tint: #33281a; color-scheme: dark; } figure svg, figure img { border-radius: 6px; filter: brightness(0.92); } }
@media print { body { background: #fff; } main { max-width: none; padding: 0; } figure, table, .card { break-inside: avoid; } h2 { break-after: avoid; } }
";
