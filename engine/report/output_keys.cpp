#include "engine/report/output_keys.hpp"

#include <fmt/format.h>

#include <iterator>

namespace trocar::engine {

std::string output_sections(std::span<const OutputTable> tables) {
    std::string page;
    for (const OutputTable& table : tables) {
        fmt::format_to(std::back_inserter(page), "\n## {}\n\n{}\n\n| name | unit | meaning |\n| --- | --- | --- |\n", table.title, table.intro);
        for (const OutputKey& key : table.keys) fmt::format_to(std::back_inserter(page), "| `{}` | {} | {} |\n", key.name, key.unit, key.meaning);
    }
    return page;
}

} // namespace trocar::engine
