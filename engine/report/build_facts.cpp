#include "engine/report/build_facts.hpp"

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

} // namespace trocar::engine
