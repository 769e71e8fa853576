// What a hard case measured, beside its bound: printed on every run, so that a margin that shrinks is seen before it is gone.
#pragma once

#include <cstdio>

namespace seldinger::test {

/// One line: the case, the figure, its bound (empty unit: a ratio).
inline void print_margin(const char* what, double measured, const char* relation, double bound, const char* unit = "") {
    std::printf("margin: %-72s %10.4g %s %g %s\n", what, measured, relation, bound, unit);
}

} // namespace seldinger::test
