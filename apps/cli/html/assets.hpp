// Style and script of the report's page.
#pragma once

namespace cairn::cli {

inline constexpr const char* kReportStyle = R"css(
:root { color-scheme: light dark; --ink: #1b1f24; --paper: #ffffff; --soft: #f3f4f6; --line: #d5d9de; --dim: #5b6470; --bad: #b3261e; --good: #1f6f43; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e8eb; --paper: #14171a; --soft: #1e2226; --line: #363c43; --dim: #9aa3ad; --bad: #ff8a80; --good: #7ddba3; }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 1200px; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.7rem; margin: .5rem 0; } h2 { font-size: 1.25rem; margin: 2rem 0 .5rem; border-bottom: 1px solid var(--line); }
p, li { max-width: 75ch; } .dim { color: var(--dim); font-size: .9rem; }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 360px), 1fr)); gap: .75rem; }
figure { margin: 0; padding: .5rem; background: var(--soft); border-radius: 8px; color: var(--ink); }
figure svg { width: 100%; height: auto; display: block; } .wide svg { max-width: 1000px; } .wide figure + figure { margin-top: .75rem; }
@media (max-width: 700px) { .wide figure { overflow-x: auto; } .wide svg { min-width: 680px; } }
figcaption { font-size: .8rem; padding: .25rem; } .legend span { white-space: nowrap; margin-right: .75rem; font-size: .85rem; }
.legend i { display: inline-block; width: .8em; height: .8em; margin-right: .3em; border-radius: 2px; }
.phases { font-size: .85rem; font-variant-numeric: tabular-nums; columns: 2 30rem; column-gap: 2rem; }
.phases > div { display: grid; grid-template-columns: minmax(7rem, 10rem) 1fr 5rem; gap: .5rem; align-items: center; break-inside: avoid; margin: .2rem 0; }
.phases b { font-weight: normal; overflow-wrap: anywhere; } .phases span:last-child { text-align: right; }
.bar { display: flex; height: 1rem; background: var(--soft); border-radius: 3px; overflow: hidden; } .bar i { flex: none; }
.scroll { overflow-x: auto; max-height: 75vh; border: 1px solid var(--line); border-radius: 8px; }
table { border-collapse: collapse; font-size: .85rem; width: 100%; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .5rem; text-align: right; white-space: nowrap; border-bottom: 1px solid var(--line); }
th { position: sticky; top: 0; background: var(--soft); cursor: pointer; user-select: none; } th[aria-sort=ascending]::after { content: " ▲"; }
th[aria-sort=descending]::after { content: " ▼"; } td.t, th.t { text-align: left; } td.bad { color: var(--bad); } td.good { color: var(--good); }
td code { font-size: .75rem; user-select: all; } input { font: inherit; padding: .3rem .5rem; margin: .25rem 0; width: min(100%, 24rem); background: var(--paper);
  color: inherit; border: 1px solid var(--line); border-radius: 6px; }
)css";

// Tables sort by a click on a head, numbers as numbers (data-v holds the exact one); the field above a table keeps rows with its text.
inline constexpr const char* kReportScript = R"js(
for (const table of document.querySelectorAll('table')) {
  const body = table.tBodies[0];
  table.tHead.addEventListener('click', event => {
    const head = event.target.closest('th');
    if (!head) return;
    const up = head.getAttribute('aria-sort') !== 'ascending', at = head.cellIndex;
    for (const other of head.parentNode.children) other.removeAttribute('aria-sort');
    head.setAttribute('aria-sort', up ? 'ascending' : 'descending');
    const value = row => { const c = row.cells[at]; return c.dataset.v === undefined ? c.textContent : parseFloat(c.dataset.v); };
    const rows = [...body.rows].sort((a, b) => {
      const x = value(a), y = value(b);
      if (typeof x === 'number' && typeof y === 'number') return (isNaN(x) ? 1 : isNaN(y) ? -1 : x - y) * (up ? 1 : -1);
      return String(x).localeCompare(String(y), undefined, { numeric: true }) * (up ? 1 : -1);
    });
    body.append(...rows);
  });
  const field = document.querySelector(`input[data-for="${table.id}"]`);
  if (field) field.addEventListener('input', () => {
    for (const row of body.rows) row.hidden = !row.textContent.includes(field.value);
  });
}
)js";

}  // namespace cairn::cli
