// A search over surfaces, from building to deciding.
#pragma once

#include "collision/search/contact_search.hpp"
#include "tests/collision/shapes.hpp"

#include <span>

namespace trocar::collision::testing {

inline ExactStats search_all(std::span<const Surface* const> surfaces, const SearchOptions& options, std::vector<SearchContact>& contacts) {
    std::vector<const SurfaceTopology*> topologies;
    std::vector<std::span<const Vec3>> positions;
    std::vector<SurfaceMotion> motions;
    for (const Surface* s : surfaces) {
        topologies.push_back(&s->topology);
        positions.push_back(s->t0);
        motions.push_back(s->motion());
    }
    ContactSearch search;
    search.build(topologies, positions, options);
    search.refit(motions);
    search.find_candidates();
    search.decide(contacts);
    return search.stats();
}

} // namespace trocar::collision::testing
