"""How the page of all studies looks: light and dark, wide and narrow, and on paper."""

STYLE = """
:root { color-scheme: light dark; --ink: #1c1e21; --soft: #5c6269; --line: #d9dce0;
  --paper: #ffffff; --shade: #f1f3f5; --focus: #0b62c4;
  --good: #1d6b3a; --claim: #8a4b00; --bad: #b00020; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e7e9; --soft: #a3a9b1; --line: #3a3e44;
  --paper: #17191c; --shade: #23272c; --focus: #7ab8ff;
  --good: #7cd09b; --claim: #f0b05e; --bad: #ff8a95; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem 1.2rem 4rem; max-width: 62rem; background: var(--paper);
  color: var(--ink); font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 1rem 0 0.6rem; }
h2 { font-size: 1.25rem; line-height: 1.3; margin: 0 0 0.5rem; }
code { font-size: 0.92em; }
h3 { font-size: 1rem; margin: 1.6rem 0 0.3rem; }
p { margin: 0.5rem 0; max-width: 46rem; }
a { color: inherit; }
section { margin-top: 3rem; padding-top: 1.5rem; border-top: 1px solid var(--line); }
section, details { scroll-margin-top: 0.5rem; }
ol, ul { padding-left: 1.9rem; }
li { margin: 0.15rem 0; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(10.5rem, 1fr));
  gap: 0.8rem; padding: 0; list-style: none; }
.cards li { margin: 0; }
.cards a { display: block; height: 100%; padding: 0.5rem; border: 1px solid var(--line);
  border-radius: 4px; font-size: 0.82rem; line-height: 1.35; text-decoration: none; }
.cards a:hover { background: var(--shade); }
.cards img { aspect-ratio: 3 / 2; object-fit: contain; padding: 0.2rem; }
figure { margin: 1rem 0; }
figcaption { color: var(--soft); font-size: 0.92rem; }
figure a { display: inline-block; }
img { display: block; width: 100%; max-width: 58rem; height: auto; margin: 0 0 0.3rem;
  padding: 0.5rem; background: #ffffff; border: 1px solid var(--line); border-radius: 4px; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0.1rem 1.2rem; margin: 0.6rem 0;
  font-size: 0.92rem; }
dt { color: var(--soft); }
dd { margin: 0; overflow-wrap: anywhere; }
details { margin: 0.5rem 0; border: 1px solid var(--line); border-radius: 4px; }
details > :not(summary) { margin: 0.4rem 0.9rem 0.8rem; }
details > table { width: calc(100% - 1.8rem); }
summary { padding: 0.4rem 0.9rem; cursor: pointer; }
summary:hover { background: var(--shade); }
details[open] > summary { border-bottom: 1px solid var(--line); }
.count { color: var(--soft); }
a:focus-visible, summary:focus-visible { outline: 3px solid var(--focus); outline-offset: 2px; }
.skip { position: absolute; left: -100rem; }
.skip:focus { position: static; }
table { border-collapse: collapse; width: 100%; font-size: 0.88rem; line-height: 1.4; }
th, td { padding: 0.28rem 0.7rem 0.28rem 0; border-bottom: 1px solid var(--line);
  text-align: left; vertical-align: top; }
th { color: var(--soft); font-weight: 600; }
td.number { font-variant-numeric: tabular-nums; white-space: nowrap; }
td:nth-child(4), td:nth-child(6) { min-width: 6.5rem; }
.good { color: var(--good); } .claim { color: var(--claim); } .bad { color: var(--bad); }
.bad { font-weight: 700; }
.small { color: var(--soft); font-size: 0.9rem; }
pre { white-space: pre-wrap; overflow-wrap: anywhere; }
@media (max-width: 44rem) {
  dl { grid-template-columns: 1fr; } dd { margin: 0 0 0.3rem; }
  thead { display: none; }
  tr { display: block; padding: 0.4rem 0; border-bottom: 1px solid var(--line); }
  td, td.number { white-space: normal; overflow-wrap: anywhere; }
  td { display: grid; grid-template-columns: 6.5rem minmax(0, 1fr); padding: 0.05rem 0; border: 0; }
  td::before { content: attr(data-label); color: var(--soft); }
  td:first-child { display: block; font-weight: 600; } td:first-child::before { content: none; }
}
@media print {
  :root { --ink: #000; --soft: #444; --line: #bbb; --paper: #fff; --good: #000; --claim: #000;
    --bad: #000; }
  body { max-width: none; padding: 0; font-size: 10.5pt; }
  section { break-before: page; border: 0; margin: 0; }
  table { font-size: 8.5pt; } td.number { white-space: normal; }
  details { border: 0; } details::details-content { content-visibility: visible; }
  figure, tr, dl { break-inside: avoid; } h2, h3 { break-after: avoid; }
}
"""
