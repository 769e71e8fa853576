// Queries of the public benchmark of continuous collision detection, with their exact answers.
// source   Wang, Ferguson, Schneider, Jiang, Attene, Panozzo, "A Large Scale Benchmark and an Inclusion-Based Algorithm for
//          Continuous Collision Detection" (2021)
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"

#include <array>
#include <filesystem>
#include <string_view>
#include <vector>

namespace trocar::engine {

struct CcdQuery {
    std::array<Vec3, 8> rows; // vertex-face: v f0 f1 f2 at t0, then at t1; edge-edge: a0 a1 b0 b1 at t0, then at t1
    bool collides = false;    // the exact answer
};

struct CcdQueryFile {
    std::vector<CcdQuery> queries;
    std::size_t rounded = 0; // coordinates that are no doubles, and were rounded: their truth may be that of other numbers
};

/// Eight rows a query, seven columns: three coordinates as numerator, denominator (integers, the latter not 0), and the
/// answer, 0 or 1, the same in all eight rows. Plain or .gz; blank lines are passed over.
/// fails   with file and line: other column counts, other numbers, a query cut off, a coordinate beyond the largest double, no query
[[nodiscard]] Result<CcdQueryFile> read_ccd_queries(const std::filesystem::path& path);
[[nodiscard]] Result<CcdQueryFile> parse_ccd_queries(std::string_view text, std::string_view file_name);

} // namespace trocar::engine
