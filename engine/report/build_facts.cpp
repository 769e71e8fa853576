#include "engine/report/build_facts.hpp"

#include "engine/report/html.hpp"

#include <fmt/format.h>

namespace trocar::engine {

namespace {

BuildFacts& facts() {
    static BuildFacts known{TROCAR_VERSION, "unknown"};
    return known;
}

} // namespace

const BuildFacts& build_facts() { return facts(); }

void name_commit(const std::string& commit) {
    if (!commit.empty()) facts().commit = commit;
}

std::string build_text() { return "trocar " + facts().version + ", commit " + facts().commit; }

std::string facts_html(const Machine& machine) {
    return fmt::format("<dt>Program</dt><dd>{}</dd><dt>Machine</dt><dd>{}, {} cores, {:.0f} GiB, {}</dd><dt>Compiler</dt><dd>{}</dd>", escape_html(build_text()),
                       escape_html(machine.processor), machine.cores, machine.memory_gib, escape_html(machine.system), escape_html(machine.compiler));
}

} // namespace trocar::engine
