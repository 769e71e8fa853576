// What draws the plots of a sweep's page: no library, no network.
#pragma once

namespace trocar::engine {

inline constexpr const char* kSweepStyle = R"css(
.choose{display:flex;flex-wrap:wrap;gap:14px 22px;margin:22px 0 8px}
.choose label{font-size:13px;color:var(--soft)}
.choose select{display:block;font:inherit;color:var(--ink);max-width:17em;padding:4px 6px;border:1px solid var(--line);border-radius:6px;background:#fff}
.plots{display:grid;grid-template-columns:repeat(auto-fill,minmax(380px,1fr));gap:28px}
.plots svg{width:100%;height:auto;overflow:visible}
.plots text{font-size:12px;fill:#6b7280}.plots .v{font-size:11px}
td.bad{color:var(--bad)}td.missing{color:var(--soft)}
)css";

/// Reads `data`: {columns, varied, rows, time, error}; rows as text; time and error, where they are not null, are the columns of the first plot. What is true counts as 1, a value of several members is named by them, a scene by its file's name. Numbers are compared as numbers where all of a column are.
inline constexpr const char* kSweepScript = R"js(
const names=data.columns,varied=data.varied,first=varied+2;
const truth={true:'1',false:'0'};
const cells=data.rows.filter(r=>r[varied+1]==='done').map(r=>r.map((s,i)=>i<first?s:truth[s]??s));
const label=s=>{try{const v=JSON.parse(s);if(v!==null&&typeof v==='object')return Object.values(v).flat().join(' ')}catch{}return s.endsWith('.json')?s.slice(s.lastIndexOf('/')+1,-5):s};
const number=s=>s!==''&&isFinite(Number(s));
const numeric=names.map((n,i)=>cells.some(r=>number(r[i]))&&cells.every(r=>r[i]===''||number(r[i])));
const levels=i=>{const s=[...new Set(cells.map(r=>r[i]))];return numeric[i]?s.sort((a,b)=>a-b):s};
const box=document.querySelector('.choose'),chosen={},filters={};
function add(label,key,options,value,store){const l=document.createElement('label');l.textContent=label;const s=document.createElement('select');
 for(const [v,t] of options){const o=document.createElement('option');o.value=v;o.textContent=t;s.append(o)}
 s.value=value;store[key]=value;s.onchange=()=>{store[key]=s.value;draw()};l.append(s);box.append(l)}
const inputs=[];for(let i=0;i<varied;i++)if(levels(i).length>1)inputs.push(i);
const outputs=[];for(let i=first;i<names.length;i++)if(numeric[i])outputs.push(i);
const option=i=>[i,names[i]];
const begin=outputs.includes(data.time)&&outputs.includes(data.error);
add('value','v',outputs.map(option),begin?data.error:outputs[0]??'',chosen);
add('across','x',[...inputs,...outputs].map(option),begin?data.time:inputs[0]??outputs[0]??'',chosen);
add('lines and rows','g',[['','one for all'],...inputs.map(option)],(begin?inputs.find(i=>names[i]!=='--budgets'):inputs[1])??'',chosen);
add('scales','s',[['ll','linear'],['gl','log across'],['lg','log value'],['gg','both log']],'ll',chosen);
for(const i of inputs)add('only '+names[i],i,[['','all'],...levels(i).map(v=>['='+v,label(v)])],'',filters);
const NS='http://www.w3.org/2000/svg';
function el(p,n,a,t){const e=document.createElementNS(NS,n);for(const k in a)e.setAttribute(k,a[k]);if(t!==undefined)e.textContent=t;p.append(e);return e}
const short=v=>{v=Number(v);return v===0?'0':Math.abs(v)>=1e5||Math.abs(v)<1e-3?v.toExponential(2):String(Number(v.toPrecision(4)))};
const hue=i=>['#2158d6','#0f8a6d','#c0702c','#8a3fb0','#c02626','#4f6b8a','#a08a00','#d64a8c'][i%8];
function ticks(a,b,log){if(log){const t=[];for(let e=Math.ceil(Math.log10(a)-1e-9);e<=Math.log10(b)+1e-9;e++)t.push(10**e);if(t.length>1)return t}
 if(a===b)return [a];const s=10**Math.floor(Math.log10((b-a)/4)),f=[1,2,5,10].find(k=>(b-a)/(k*s)<=6)*s,t=[];for(let v=Math.ceil(a/f-1e-9)*f;v<=b+f*1e-6;v+=f)t.push(Math.abs(v)<f*1e-6?0:v);return t}
function scale(values,from,to,log){let a=Math.min(...values),b=Math.max(...values);const f=log?Math.log:v=>v;
 const at=v=>a===b?(from+to)/2:from+(f(v)-f(a))/(f(b)-f(a))*(to-from);return {at,ticks:ticks(a,b,log)}}
const mean=l=>l.reduce((a,b)=>a+b,0)/l.length;
function group(rows,g,x,v){const lines=new Map();for(const r of rows){if(r[v]==='')continue;const k=g===''?'':r[g];if(!lines.has(k))lines.set(k,new Map());
 const m=lines.get(k);if(r[x]==='')continue;if(!m.has(r[x]))m.set(r[x],[]);m.get(r[x]).push(Number(r[v]))}return lines}
function draw(){const host=document.querySelector('.plots');host.textContent='';const v=chosen.v,x=chosen.x,g=chosen.g;if(v===''||x==='')return;
 const rows=cells.filter(r=>Object.entries(filters).every(([i,f])=>f===''||r[i]===f.slice(1)));
 const lines=group(rows,g,x,v);curves(host,lines,x,v,g);if(g!==''&&Number(x)<varied&&g!==x)heat(host,lines,x,v,g)}
function curves(host,lines,x,v,g){const W=560,H=360,L=70,R=g===''?18:112,T=14,B=52,svg=el(host,'svg',{viewBox:`0 0 ${W} ${H}`,role:'img'});
 const lx=chosen.s[0]==='g'&&numeric[x],ly=chosen.s[1]==='g';const xs=levels(x),pos=k=>numeric[x]?Number(k):xs.indexOf(k);
 const ok=(k,l)=>(!lx||pos(k)>0)&&(!ly||Math.min(...l)>0);const points=[];for(const m of lines.values())for(const [k,l] of m)if(ok(k,l))points.push([pos(k),...l]);
 if(!points.length){el(svg,'text',{x:L,y:H/2},'nothing to show on these scales');return}
 const X=scale(points.map(p=>p[0]),L+8,W-R-8,lx),Y=scale(points.flatMap(p=>p.slice(1)),H-B-8,T+8,ly);
 for(const t of Y.ticks){const y=Y.at(t);if(y<T||y>H-B)continue;el(svg,'line',{x1:L,x2:W-R,y1:y,y2:y,stroke:'#e5e7eb'});el(svg,'text',{x:L-8,y:y+4,'text-anchor':'end'},short(t))}
 const marks=numeric[x]?X.ticks.map(t=>[t,short(t)]):xs.map((k,i)=>[i,label(k).slice(0,16)]);
 for(const [t,s] of marks){const px=X.at(t);if(px<L-1||px>W-R+1)continue;el(svg,'line',{x1:px,x2:px,y1:H-B,y2:H-B+5,stroke:'#9ca3af'});el(svg,'text',{x:px,y:H-B+19,'text-anchor':'middle'},s)}
 el(svg,'text',{x:(L+W-R)/2,y:H-10,'text-anchor':'middle'},names[x]);el(svg,'text',{x:L,y:T-2},names[v]+(g===''?'':' by '+names[g]));
 let i=0;for(const [name,m] of lines){const c=hue(i),p=[...m].filter(([k,l])=>ok(k,l)).sort((a,b)=>pos(a[0])-pos(b[0]));
  const up=p.map(([k,l])=>`${X.at(pos(k))},${Y.at(Math.max(...l))}`),down=p.map(([k,l])=>`${X.at(pos(k))},${Y.at(Math.min(...l))}`).reverse();
  el(svg,'polygon',{points:[...up,...down].join(' '),fill:c,opacity:.13});
  if(Number(x)<varied)el(svg,'polyline',{points:p.map(([k,l])=>`${X.at(pos(k))},${Y.at(mean(l))}`).join(' '),fill:'none',stroke:c,'stroke-width':1.6});
  for(const [k,l] of p){const dot=el(svg,'circle',{cx:X.at(pos(k)),cy:Y.at(mean(l)),r:3,fill:c});el(dot,'title',{},`${names[x]} ${k}${name===''?'':', '+names[g]+' '+name}: ${short(mean(l))} (${short(Math.min(...l))} to ${short(Math.max(...l))}, ${l.length} runs)`)}
  if(name!==''&&i<14)el(svg,'text',{x:W-R+10,y:T+14+15*i,style:'fill:'+c},label(name).slice(0,16));i++}}
function heat(host,lines,x,v,g){const xs=levels(x),gs=levels(g);if(xs.length>60||gs.length>60)return;const W=560,L=110,T=14,B=52,cw=(W-L-10)/xs.length,ch=Math.max(14,Math.min(34,300/gs.length)),H=T+gs.length*ch+B;
 const svg=el(host,'svg',{viewBox:`0 0 ${W} ${H}`,role:'img'}),all=[];for(const m of lines.values())for(const l of m.values())all.push(mean(l));
 const a=Math.min(...all),b=Math.max(...all);el(svg,'text',{x:L,y:T-2},`mean ${names[v]}: ${short(a)} to ${short(b)}`);
 gs.forEach((k,j)=>{el(svg,'text',{x:L-8,y:T+j*ch+ch/2+4,'text-anchor':'end'},label(k).slice(0,16));xs.forEach((q,i)=>{const l=lines.get(k)?.get(q);if(!l)return;
  const f=b>a?(mean(l)-a)/(b-a):.5,c=el(svg,'rect',{x:L+i*cw,y:T+j*ch,width:Math.max(cw-1,1),height:ch-1,fill:`hsl(221 72% ${94-52*f}%)`});el(c,'title',{},`${names[x]} ${q}, ${names[g]} ${k}: ${short(mean(l))}, ${l.length} runs`);
  if(cw>44)el(svg,'text',{class:'v',x:L+i*cw+cw/2,y:T+j*ch+ch/2+4,'text-anchor':'middle',style:f>.5?'fill:#fff':''},short(mean(l)))})});
 const every=Math.ceil(xs.length/12);xs.forEach((q,i)=>{if(i%every===0)el(svg,'text',{x:L+i*cw+cw/2,y:H-B+17,'text-anchor':'middle'},label(q).slice(0,16))});el(svg,'text',{x:(L+W)/2,y:H-12,'text-anchor':'middle'},names[x])}
draw();
)js";

} // namespace trocar::engine
