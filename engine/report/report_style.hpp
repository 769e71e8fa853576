// The look of report.html.
#pragma once

namespace trocar::engine {

inline constexpr const char* kReportStyle = R"css(
:root{color-scheme:light;--ink:#1f2937;--soft:#6b7280;--line:#e5e7eb;--blue:#2158d6;--good:#0f8a6d;--note:#b45309;--bad:#c02626;--pale:#f7f8fa}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:#fff;color:var(--ink);font:16px/1.55 -apple-system,BlinkMacSystemFont,"Segoe UI",Inter,Roboto,"Helvetica Neue",Arial,sans-serif;font-weight:400}
main.broad{max-width:1500px}
main{max-width:1140px;margin:0 auto;padding:40px 28px 64px}
h1{font-weight:300;font-size:clamp(26px,4.4vw,42px);line-height:1.16;letter-spacing:-.018em;margin:2px 0 10px}
h2{font-weight:500;font-size:20px;letter-spacing:-.01em;margin:56px 0 14px}
h3{font-weight:500;font-size:15px;margin:0 0 2px}
p{margin:0 0 10px}
.over{font-size:13px;color:var(--soft);letter-spacing:.04em}
.lead{font-size:clamp(16px,2vw,19px);font-weight:300;color:#374151;max-width:46em;margin:0 0 4px}
.soft,figcaption,.advice{color:var(--soft);font-size:14px;line-height:1.45}
.verdict{border-left:3px solid var(--good);padding-left:20px;margin:0 0 30px}
.verdict.note{border-color:#e0a23c}.verdict.bad{border-color:var(--bad)}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(132px,1fr));border:1px solid var(--line);border-radius:10px;overflow:hidden;margin:26px 0 0}
.figures>div{box-shadow:0 0 0 .5px var(--line);padding:14px 16px 12px}
.figures b{display:block;font-weight:300;font-size:25px;line-height:1.2;letter-spacing:-.015em;font-variant-numeric:tabular-nums;white-space:nowrap}
.figures b small{font-size:14px;color:var(--soft);font-weight:400;letter-spacing:0}
.figures span{font-size:13px;color:var(--soft)}
table{border-collapse:collapse;width:100%;font-size:15px;font-variant-numeric:tabular-nums}
th{font-weight:500;text-align:left;color:var(--soft);font-size:13px;padding:6px 14px 6px 0;border-bottom:1px solid var(--line);vertical-align:bottom}
td{padding:8px 14px 8px 0;border-bottom:1px solid #f0f1f3;vertical-align:top}
td.n,th.n{text-align:right;white-space:nowrap}th.wrap{white-space:normal}
.many{font-size:13px}.many th{font-size:12px}.many td,.many th{padding-right:8px}
.scroll{overflow-x:auto;-webkit-overflow-scrolling:touch}.scroll table{min-width:720px}
.verdict-word{white-space:nowrap}
.dot{display:inline-block;width:9px;height:9px;border-radius:50%;background:var(--good);margin-right:10px;vertical-align:1px}
.dot.note{background:#e0a23c}.dot.bad{background:var(--bad)}
.losses td:first-child{white-space:nowrap;width:16em}
.nothing{margin:14px 0 0;font-size:14px;color:var(--soft);line-height:1.9}.nothing b{font-weight:400;margin-right:16px}.nothing span{display:inline-block;margin-right:20px}.nothing .dot{width:7px;height:7px;margin-right:7px}
.losses .advice{display:block}
figure{margin:0;min-width:0}
figure img,figure svg{display:block;width:100%;height:auto;border-radius:10px;border:1px solid var(--line);background:#fff}
figure svg{border:0;border-radius:0}
figure svg text{font-family:inherit!important}
figcaption{margin-top:8px}
.grid{display:grid;grid-template-columns:repeat(2,minmax(0,1fr));gap:28px 28px}
.lead+.plots{margin-top:30px}
.save{display:block;white-space:nowrap}.save button{font:inherit;font-size:13px;color:var(--blue);background:none;border:0;padding:0 2px;cursor:pointer;text-decoration:underline}
@media print{.save{display:none}}
.wide{grid-column:1/-1}
.bars td{border:0;padding:5px 14px 5px 0;vertical-align:middle}
.bars td:nth-child(3){width:62%}
.bar{height:13px;border-radius:3px;background:var(--blue);min-width:1px}
.tags span{display:inline-block;border:1px solid var(--line);border-radius:99px;padding:2px 12px;margin:0 6px 8px 0;font-size:14px}
.tags .off{color:#a0a7b1;text-decoration:line-through;text-decoration-color:#d4d8dd}
dl{display:grid;grid-template-columns:max-content minmax(0,1fr);gap:6px 22px;margin:0;font-size:15px}
dt{color:var(--soft)}dd{margin:0;overflow-wrap:anywhere}
code,pre{font:13.5px/1.5 ui-monospace,SFMono-Regular,Menlo,Consolas,"DejaVu Sans Mono",monospace}
pre{background:var(--pale);border:1px solid var(--line);border-radius:8px;padding:12px 16px;overflow-x:auto;white-space:pre-wrap;overflow-wrap:anywhere;margin:0 0 12px}
.notices{background:#fff9ec;border:1px solid #f3e2b8;border-radius:8px;padding:10px 16px;font-size:14px;margin:22px 0 0}
footer{margin-top:56px;border-top:1px solid var(--line);padding-top:14px;color:var(--soft);font-size:13px}
@media(max-width:720px){main{padding:24px 16px 44px}h2{margin-top:42px}.grid{grid-template-columns:minmax(0,1fr)}
.losses td{display:block;border:0;padding:0}.losses td:first-child{padding-top:10px;width:auto}.losses td+td{padding:0 0 10px 19px;border-bottom:1px solid #f0f1f3}
dl{grid-template-columns:minmax(0,1fr);gap:0}dd{margin-bottom:10px}.bars td:nth-child(3){width:44%}.figures b{font-size:22px}}
@media print{main{padding:0}figure,table,.figures{break-inside:avoid}}
)css";

} // namespace trocar::engine
