#include "engine/experiments/coherence_comparison.hpp"

#include "collision/search/contact_search.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>

namespace trocar::engine {
namespace {

using collision::SearchContact;

bool same_bits(const SearchContact& a, const SearchContact& b) noexcept {
    const Contact &x = a.contact, &y = b.contact;
    const auto same = [](const auto& p, const auto& q) { return std::memcmp(&p, &q, sizeof p) == 0; };
    return a.id_a == b.id_a && a.id_b == b.id_b && x.origin == y.origin && x.a == y.a && x.b == y.b &&
           same(x.time, y.time) && same(x.normal, y.normal) && same(x.point, y.point) && same(x.gap, y.gap);
}

} // namespace

std::size_t CoherenceComparison::steps_with_contacts() const noexcept {
    return static_cast<std::size_t>(std::count_if(steps.begin(), steps.end(), [](const Step& s) { return s.contacts > 0; }));
}

double CoherenceComparison::share(bool with_contacts_only) const noexcept {
    double anew = 0.0, coherent = 0.0;
    for (const Step& step : steps) {
        if (with_contacts_only && step.contacts == 0) continue;
        anew += step.anew_ms;
        coherent += step.coherent_ms;
    }
    return anew > 0.0 ? coherent / anew : 0.0;
}

std::string CoherenceComparison::text() const {
    const auto plain = std::count_if(steps.begin(), steps.end(), [](const Step& s) { return s.plain; });
    std::string with_contacts = "none has contacts";
    if (steps_with_contacts() > 0)
        with_contacts = fmt::format("{:.3f} over the {} with contacts", share(true), steps_with_contacts());
    return fmt::format("processor time with what is kept from step to step over that without: {:.3f} over {} steps, {}; {} of them done "
                       "plainly; {}",
                       share(), steps.size(), with_contacts, plain, same ? "the same contacts, bit for bit" : "OTHER CONTACTS");
}

nlohmann::ordered_json CoherenceComparison::json() const {
    nlohmann::ordered_json out{{"share", share()},
                               {"share_with_contacts", share(true)},
                               {"steps_with_contacts", steps_with_contacts()},
                               {"same_contacts", same}};
    for (const Step& step : steps)
        out["steps"].push_back({{"contacts", step.contacts},
                                {"anew_ms", step.anew_ms},
                                {"coherent_ms", step.coherent_ms},
                                {"anew_work", step.anew_work},
                                {"coherent_work", step.coherent_work},
                                {"plain", step.plain}});
    return out;
}

Result<CoherenceComparison> compare_coherence(std::size_t steps,
                                              const std::function<std::vector<collision::SurfaceMotion>(std::size_t k)>& motions,
                                              const collision::CoherentOptions& options) {
    collision::SearchOptions usual;
    static_cast<collision::PairOptions&>(usual) = options;
    usual.between = options.between;
    usual.within = options.within;
    usual.tree = options.tree;
    collision::CoherentSearch coherent;
    collision::ContactSearch anew;
    std::vector<const collision::SurfaceTopology*> surfaces;
    std::vector<std::span<const Vec3>> positions;
    for (const collision::SurfaceMotion& motion : motions(0)) {
        surfaces.push_back(motion.topology);
        positions.push_back(motion.t0);
    }
    if (auto built = coherent.build(surfaces, positions, options); !built) return built.error();
    anew.build(surfaces, positions, usual);
    CoherenceComparison out;
    std::vector<SearchContact> found, wanted;
    for (std::size_t k = 0; k < steps; ++k) {
        const std::vector<collision::SurfaceMotion> moved = motions(k);
        CoherenceComparison::Step step;
        Result<void> started = {};
        const auto timed = [](double& ms, const auto& work) {
            const std::int64_t start = thread_cpu_ns();
            work();
            ms = 1e-6 * static_cast<double>(thread_cpu_ns() - start);
        };
        const auto run_anew = [&] {
            timed(step.anew_ms, [&] {
                anew.refit(moved);
                anew.find_candidates();
                anew.decide(wanted);
            });
        };
        if (k % 2 == 0) run_anew();
        timed(step.coherent_ms, [&] {
            started = coherent.start_step(moved);
            if (!started) return;
            coherent.find_candidates();
            coherent.decide(found);
        });
        if (!started) return started.error();
        if (k % 2 != 0) run_anew();
        step.contacts = wanted.size();
        step.plain = coherent.coherence().plain;
        step.anew_work = coherent.plain_work(anew);
        step.coherent_work = coherent.coherence().work;
        out.same = out.same && std::equal(found.begin(), found.end(), wanted.begin(), wanted.end(), same_bits);
        out.steps.push_back(step);
    }
    return out;
}

} // namespace trocar::engine
