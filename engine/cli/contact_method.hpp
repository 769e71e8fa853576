// `contacts --method NAME`: which combination of techniques finds the contacts. Words joined by '-', in any order.
#pragma once

#include "base/result.hpp"
#include "collision/search/contact_search.hpp"
#include "engine/render/culled_search.hpp"

#include <optional>
#include <string>

namespace trocar::engine {

/// Text for --help: every word with its meaning.
inline constexpr const char* kMethodWords =
    "words joined by '-': exact (the default of all); dop6, dop14, dop18, dop26 (bounds); arity2, arity4, arity8 (children of a node); "
    "sah, median, paper (how the tree is built); cluster1 .. cluster64 (triangles in a leaf); fine (a second test along the directions "
    "of a 26-DOP); plain (no SIMD in the broad phase); "
    "brute (every pair of features, no tree). Or one of: chromatic (sets of non-adjacent triangles, culled where that is predicted to "
    "pay), "
    "chromatic-cpu, chromatic-gl (always culled, by the CPU or by OpenGL), chromatic-none (never culled), chromatic-query (culled "
    "as by Govindaraju et al. 2005, by OpenGL's occlusion queries), "
    "image-space, image-space-gl (triangles of static meshes; whole patches are pruned first), image-space-flat (triangle by "
    "triangle), image-space-paper (as in the image-space paper: loses crossings below a pixel)";

struct ContactMethod {
    collision::TreeOptions tree;
    bool simd = true;
    bool brute = false;
    std::optional<CullMethod> culling; // by chromatic sets; the words above do not go with it
    bool image_space = false;          // pairs of triangles, of static meshes; culled as `culling` says
    bool as_paper = false;             // of image_space: by pixel centres, which can lose crossings
    bool patches = true;               // of image_space otherwise: whole patches first

    /// The full name, as in the statistics.
    [[nodiscard]] std::string name() const;
};

[[nodiscard]] Result<ContactMethod> parse_contact_method(const std::string& text);

} // namespace trocar::engine
