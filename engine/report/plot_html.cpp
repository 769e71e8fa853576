#include "engine/report/plot_html.hpp"

#include "engine/report/html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

namespace trocar::engine {

namespace {

constexpr const char* kSaveScript = R"js(<script>
function saveText(name,text,type){const a=document.createElement('a'),u=URL.createObjectURL(new Blob([text],{type}));a.href=u;a.download=name;document.body.append(a);a.click();a.remove();setTimeout(()=>URL.revokeObjectURL(u),1000)}
function saveSvg(b){const f=b.closest('figure'),s=f.querySelector('svg').cloneNode(true);s.setAttribute('font-family','Helvetica, Arial, sans-serif');saveText(f.dataset.plot+'.svg',new XMLSerializer().serializeToString(s),'image/svg+xml')}
function saveCsv(b){const f=b.closest('figure'),names=f.dataset.files.split(' '),out=[];
for(const n of names){const e=[...b.closest('.plots').querySelectorAll('script[data-file]')].find(d=>d.dataset.file===n);
if(names.length>1)out.push('# '+n);if(e.dataset.columns)out.push(e.dataset.columns);
for(const l of e.textContent.split('\n')){const w=l.match(/"[^"]*"|[^\s]+/g);if(w)out.push(w.join(','))}}
saveText(f.dataset.plot+'.csv',out.join('\n')+'\n','text/csv')}
</script>
)js";

/// Text that stands in a script element: nothing in it can end the element.
std::string in_script(std::string text) {
    for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at)) text[at] = ' ';
    return text;
}

} // namespace

double zero_on_logarithmic_axis(double least) noexcept {
    return std::isfinite(least) && least > 0.0 ? std::pow(10.0, std::floor(std::log10(0.3 * least) - 0.5) + 0.5) : 1.0;
}

std::string plots_html(std::span<const Plot> plots) {
    std::string page = "<div class=\"plots\"><div class=\"grid\">\n", files_html;
    const auto out = std::back_inserter(page);
    std::vector<std::string> written;
    for (const Plot& plot : plots) {
        std::string files;
        for (const PlotData& file : plot.data) {
            files += (files.empty() ? "" : " ") + file.name;
            if (std::find(written.begin(), written.end(), file.name) != written.end()) continue;
            written.push_back(file.name);
            files_html += fmt::format("<script type=\"text/plain\" data-file=\"{}\" data-columns=\"{}\">\n{}</script>\n", escape_html(file.name),
                                      escape_html(file.columns), in_script(file.text));
        }
        fmt::format_to(out,
                       "<figure data-plot=\"{0}\" data-files=\"{1}\"><h3>{2}</h3><div role=\"img\" aria-label=\"{2}\">{3}</div><figcaption>{4}"
                       "<span class=\"save\">Save as <button onclick=\"saveSvg(this)\">SVG</button>{5}</span></figcaption></figure>\n",
                       escape_html(plot.name), escape_html(files), escape_html(plot.title), plot.svg, escape_html(plot.caption),
                       files.empty() ? "" : " <button onclick=\"saveCsv(this)\">CSV</button>");
    }
    return page + "</div>\n" + files_html + kSaveScript + "</div>\n";
}

} // namespace trocar::engine
