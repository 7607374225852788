"""How the page looks; its colours are those of its figures."""

from __future__ import annotations

from ambulo.study.curves import DARK, GRID, INK, MUTED, PAPER, RUNS

LIGHT_COLOURS = (
    f"--back:#f6f6f3;--paper:#fff;--ink:{INK};--soft:#48505a;\n"
    f"--muted:{MUTED};--line:{GRID};--accent:{RUNS[0]};--yes:#2b7d52;--no:#a8481a;\n"
    f"--run1:{RUNS[0]};--run2:{RUNS[1]};--run3:{RUNS[2]}"
)

DARK_COLOURS = (
    f"--back:#13161a;--paper:{DARK[PAPER]};--ink:{DARK[INK]};\n"
    f"--soft:#c0c7cf;--muted:{DARK[MUTED]};--line:{DARK[GRID]};--accent:{DARK[RUNS[0]]};"
    "--yes:#66c997;--no:#f29a5e;\n"
    f"--run1:{DARK[RUNS[0]]};--run2:{DARK[RUNS[1]]};--run3:{DARK[RUNS[2]]}"
)

RULES = """
*{box-sizing:border-box}
html{scroll-behavior:smooth;-webkit-text-size-adjust:100%}
@media (prefers-reduced-motion:reduce){html{scroll-behavior:auto}}
body{margin:0;background:var(--back);color:var(--ink);line-height:1.6;
font:1rem/1.6 Inter,ui-sans-serif,system-ui,-apple-system,"Segoe UI",Roboto,Arial,sans-serif}
body>*{max-width:74rem;margin-inline:auto;padding-inline:clamp(1rem,4vw,2.5rem)}
p{margin:0 0 1rem;max-width:44rem;text-wrap:pretty}
.prose{columns:28rem 2;column-gap:2.6rem}
.prose p{break-inside:avoid}
a{color:var(--accent);text-underline-offset:.18em;text-decoration-thickness:1px}
:focus-visible{outline:2px solid var(--accent);outline-offset:3px;border-radius:3px}
h1,h2,h3{line-height:1.2;letter-spacing:-.018em;text-wrap:balance}
h1{font-size:clamp(2rem,5.5vw,3.1rem);margin:.4rem 0 1rem;font-weight:700;letter-spacing:-.03em}
h2{font-size:1.65rem;margin:0 0 1.1rem}
h3{font-size:1.12rem;margin:0 0 .3rem}
h3 small,th small{font-weight:400;font-size:.875rem;color:var(--muted);margin-left:.5em}
.top{padding-top:clamp(2.5rem,7vw,5rem)}
.eyebrow{color:var(--muted);font-size:.875rem;margin:0}
.lead{font-size:1.18rem;color:var(--soft);max-width:46rem}
.note,small{font-size:.875rem;color:var(--muted)}
.tiles{display:grid;gap:1px;margin:2.2rem 0 0;background:var(--line);border:1px solid var(--line);
border-radius:12px;overflow:hidden;grid-template-columns:repeat(auto-fit,minmax(min(14rem,100%),1fr))}
.tiles div{background:var(--paper);padding:1.1rem 1.25rem;display:flex;flex-direction:column}
.tiles dt{order:2;font-size:.9rem;line-height:1.4;color:var(--soft)}
.tiles dd{order:1;margin:0;font-size:1.75rem;font-weight:650;letter-spacing:-.025em;
font-variant-numeric:tabular-nums;line-height:1.3}
.tiles dd.other{order:3;font-size:.875rem;font-weight:400;letter-spacing:0;color:var(--muted);
margin-top:auto;padding-top:.5rem}
.notice{margin-top:1.5rem}
.notice details{border:1px solid var(--line);border-left:3px solid var(--no);border-radius:8px;
background:var(--paper);padding:.8rem 1.1rem}
.notice ul{columns:18rem;margin:.8rem 0 .2rem;padding-left:1.1rem;font-size:.9rem}
summary{cursor:pointer}
nav{display:flex;flex-wrap:wrap;gap:.35rem 1.4rem;margin-top:2rem;font-size:.95rem}
nav a{text-decoration:none}
nav a:hover{text-decoration:underline}
section{padding-top:3.5rem}
section h3{margin-top:2.6rem}
.card h3,figure h3{margin-top:0}
figure,.card{margin:0;background:var(--paper);border:1px solid var(--line);border-radius:12px;
padding:1rem 1.1rem 1.1rem;min-width:0}
img{display:block;width:100%;height:auto}
.grid{display:grid;gap:1.1rem;grid-template-columns:repeat(auto-fill,minmax(min(20rem,100%),1fr))}
.grid{margin-top:1.4rem}
@media (min-width:46rem){.wide{grid-column:span 2}}
figcaption{margin-top:.6rem}
figcaption b{margin-right:.6em}
figcaption span.note{display:inline-block}
figcaption p{margin:.5rem 0 0}
.legend{width:100%;margin-top:.5rem;font-size:.92rem}
.legend th,.legend td{padding:.12rem .5rem .12rem 0;border:0;font-weight:400;text-align:left}
.legend td:last-child{text-align:right;padding-right:0}
.dot{display:inline-block;width:.62em;height:.62em;border-radius:50%;margin-right:.5em}
.run1{background:var(--run1)}.run2{background:var(--run2)}.run3{background:var(--run3)}
.cards{display:grid;gap:1.1rem;grid-template-columns:repeat(auto-fill,minmax(min(27rem,100%),1fr))}
.card{display:flex;flex-direction:column;gap:.7rem}
.card>*{margin:0}
.card h3+.note{margin-top:-.6rem}
.shot{display:block;border-radius:8px;overflow:hidden;background:#fff}
.card details .shot{margin-top:.6rem}
.measures{display:grid;gap:.3rem 1.6rem;margin:0;font-size:.9rem;
grid-template-columns:repeat(auto-fill,minmax(min(15rem,100%),1fr))}
.measures div{display:flex;justify-content:space-between;gap:1rem;
border-bottom:1px solid var(--line);padding-bottom:.25rem}
.measures dt{color:var(--muted)}
.measures dd{margin:0;text-align:right;font-variant-numeric:tabular-nums;overflow-wrap:anywhere}
.settings{grid-template-columns:repeat(auto-fill,minmax(min(21rem,100%),1fr));margin-top:1.4rem}
.card>.measures+.note{margin-top:auto;padding-top:.3rem}
.points{margin:0;display:grid;gap:1.1rem;
grid-template-columns:repeat(auto-fill,minmax(min(20rem,100%),1fr))}
.points div{border-top:2px solid var(--line);padding-top:.8rem}
.points dt{font-weight:650;margin-bottom:.25rem}
.points dd{margin:0;color:var(--soft);overflow-wrap:anywhere}
.scroll{overflow-x:auto;background:var(--paper);border:1px solid var(--line);border-radius:12px;
margin:1.2rem 0 .8rem;padding:.4rem 1.1rem .6rem;max-width:100%}
table{border-collapse:collapse;font-size:.92rem;font-variant-numeric:tabular-nums}
.scroll table{min-width:100%}
.scroll th,.scroll td{padding:.42rem 1rem .42rem 0;text-align:left;vertical-align:top;
white-space:nowrap}
.scroll thead th{color:var(--muted);font-weight:500;font-size:.84rem;vertical-align:bottom}
.scroll .group{color:var(--ink);font-weight:650;border-bottom:1px solid var(--line)}
.scroll tbody{border-top:1px solid var(--line)}
.scroll tbody th{font-weight:600}
.scroll .when{font-weight:400}
.scroll .number{text-align:right}
.scroll .first,.scroll .group{padding-left:.6rem}
.scroll tr>:last-child{padding-right:0}
.scroll .why{white-space:normal;min-width:12rem}
.why small{display:block;line-height:1.4}
.yes{color:var(--yes);white-space:nowrap}.no{color:var(--no);white-space:nowrap}
.tally{display:inline-grid;grid-template-columns:minmax(4.3em,auto) auto;gap:.5em;
align-items:center}
.bar{display:inline-block;width:3.2rem;height:.42rem;border-radius:1rem;background:var(--line);
overflow:hidden}
.bar i{display:block;height:100%;background:var(--yes);border-radius:1rem}
ul{padding-left:1.2rem}
footer{padding-block:4rem 3rem;font-size:.875rem;color:var(--muted)}
@media print{nav{display:none}figure,.card,tr{break-inside:avoid}}
"""

STYLE = (
    f"\n:root{{color-scheme:light dark;{LIGHT_COLOURS}}}\n"
    f"@media (prefers-color-scheme:dark){{:root{{{DARK_COLOURS}}}}}{RULES}"
)
