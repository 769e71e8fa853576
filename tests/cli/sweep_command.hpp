// A sweep of a wire in a tube, as its tests run it.
#pragma once

#include "program.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace trocar::cli_test {


/// 12 runs of a wire in a tube: three budgets, two speeds of its script, twice each.
inline const std::string kSweep = R"({
    "scene": "scenes/tube.json", "command": "run", "options": ["-n", "6"], "repeat": 2,
    "vary": {"/budget": ["work:10", "work:100", "exact"], "/instruments/wire/friction": {"from": 0.0, "to": 0.2, "count": 2}},
    "collect": {"exits": "/lumen_exits", "force": "/largest_contact_force_n", "hash": "/state_hash",
        "peak": {"column": "max_contact_force_n", "take": "max"}}
})";

struct Broken {
    const char* text;
    const char* says; // a piece of the message
};

using Rows = std::vector<std::vector<std::string>>;

/// A table without quoted cells.
inline Rows rows_of(const std::string& csv) {
    Rows rows;
    std::istringstream in(csv);
    for (std::string line; std::getline(in, line);) {
        std::vector<std::string>& row = rows.emplace_back();
        std::istringstream cells(line + ",");
        for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    }
    return rows;
}

class SweepCommand : public Program {
protected:
    SweepCommand() {
        fs::create_directory(folder / "scenes");
        write("scenes/tube.json", kTube);
    }

    fs::path write_sweep(const std::string& text = kSweep) const { return write("sweep.json", text); }

    Ended sweep(std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments = {"sweep", (folder / "sweep.json").string()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return call(arguments);
    }
    Ended sweep_into(const std::string& name, std::vector<std::string> more = {}) const {
        more.insert(more.begin(), {"--out", (folder / name).string()});
        return sweep(std::move(more));
    }
    /// The table of a sweep that runs from its beginning.
    std::string table_of(const std::string& name, std::vector<std::string> more = {}) const {
        const fs::path table = folder / (name + ".csv");
        more.insert(more.end(), {"--collect", table.string()});
        const Ended ended = sweep_into(name, more);
        EXPECT_TRUE(ended_with(ended, 0));
        return text_of(table);
    }
};

} // namespace trocar::cli_test
