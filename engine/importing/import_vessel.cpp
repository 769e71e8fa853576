#include "engine/importing/import_vessel.hpp"

#include "base/inside.hpp"
#include "engine/importing/fit_instrument.hpp"
#include "spheretree/lumen/build_lumen.hpp"
#include "spheretree/lumen/lumen_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace trocar::engine {

namespace {

/// Of an end's radius, to the tip of a branch: the branch ends there.
constexpr double kEndReach = 2.0;
/// Of an end's radius, from its cap: places at which a way may begin, tried in this order.
constexpr double kBegins[] = {0.5, 1.0, 0.25, 0.1};

Vec3 place_behind(const VesselEnd& end, const InsideTest& inside) {
    for (const double share : kBegins)
        if (const Vec3 p = end.centre + share * end.radius * end.inward; inside.inside(p)) return p;
    return end.centre;
}

/// Of the narrowest place on the way to it: a closed end that is wider is a sac, not where a vessel was cut.
constexpr double kDome = 1.4;
/// Times its radius: an opening counts for so much wider than a closed end when an inlet is chosen; a sac for so much.
constexpr double kOpenWeight = 2.0, kDomeWeight = 0.1;

/// The tip of a branch as an end that is closed.
VesselEnd tip_of(const CentrelineBranch& branch) {
    VesselEnd end;
    const std::size_t last = branch.points.size() - 1;
    double along = 0.0;
    std::size_t behind = last;
    end.radius = branch.radii[last]; // small where the branch ends in the corner of a flat cap: wider places behind it decide
    while (behind > 0 && along < 2.0 * end.radius) {
        along += (branch.points[behind] - branch.points[behind - 1]).norm();
        end.radius = std::max(end.radius, branch.radii[--behind]);
    }
    end.centre = branch.points[last];
    const Vec3 back = branch.points[behind] - branch.points[last];
    end.inward = back.norm() > 0.0 ? Vec3(back.normalized()) : Vec3(Vec3::UnitZ());
    end.open = false;
    end.dome = end.radius > kDome * *std::min_element(branch.radii.begin(), branch.radii.begin() + static_cast<std::ptrdiff_t>(behind) + 1);
    return end;
}

bool wider(const VesselEnd& a, const VesselEnd& b) {
    return std::tuple(-a.radius, a.centre.x(), a.centre.y(), a.centre.z()) < std::tuple(-b.radius, b.centre.x(), b.centre.y(), b.centre.z());
}

std::size_t choose_inlet(const std::vector<VesselEnd>& ends, const std::optional<Vec3>& near) {
    const auto weight = [](const VesselEnd& end) { return end.radius * (end.open ? kOpenWeight : end.dome ? kDomeWeight : 1.0); };
    const auto best = near ? std::min_element(ends.begin(), ends.end(), [&](const VesselEnd& a, const VesselEnd& b) {
        return (a.centre - *near).squaredNorm() < (b.centre - *near).squaredNorm();
    }) : std::min_element(ends.begin(), ends.end(), [&](const VesselEnd& a, const VesselEnd& b) {
        return weight(a) != weight(b) ? weight(a) > weight(b) : wider(a, b);
    });
    return static_cast<std::size_t>(best - ends.begin());
}

class VesselImporter {
public:
    VesselImporter(MendedVessel mended, const VesselOptions& options, spheretree::LumenTree lumen)
        : mended_(std::move(mended)), options_(options), lumen_(std::move(lumen)), inside_(mended_.surface) {}

    Result<ImportedVessel> run() {
        std::vector<VesselEnd> ends = mended_.openings;
        if (const Result<void> found = add_closed_ends(ends); !found.ok()) return found.error();
        const std::size_t inlet = choose_inlet(ends, options_.inlet);
        const Vec3 root = ends[inlet].open ? place_behind(ends[inlet], inside_) : ends[inlet].centre;
        Result<std::vector<CentrelineBranch>> branches = find_branches(mended_.surface, lumen_, root, mended_.openings);
        if (!branches.ok()) return branches.error();
        made_.branches = std::move(*branches);
        if (made_.branches.empty()) return Error{ErrorCode::BadMesh, "no way leads from its inlet: it holds one inscribed sphere only"};
        made_.ends = {ends[inlet]};
        made_.end_branch = {0};
        name_ends(inlet);
        made_.repairs = std::move(mended_.repairs);
        made_.was_sound = mended_.was_sound;
        made_.surface = std::move(mended_.surface);
        if (const Result<void> fits = fit_instrument(made_, inside_, options_.device); !fits.ok()) return fits.error();
        return std::move(made_);
    }

private:
    /// From anywhere into every dead end: those that no opening explains.
    Result<void> add_closed_ends(std::vector<VesselEnd>& ends) {
        Index widest = 0;
        for (Index ball = 1; ball < lumen_.ball_count(); ++ball)
            if (lumen_.ball(ball).radius > lumen_.ball(widest).radius) widest = ball;
        const Vec3 start = ends.empty() ? lumen_.ball(widest).centre : place_behind(ends[choose_inlet(ends, {})], inside_);
        const Result<std::size_t> ways = add_tips_from(start, ends);
        if (!ways.ok()) return ways.error();
        if (ends.empty()) return Error{ErrorCode::BadMesh, "no end of a vessel was found; expected a tube, or a tree of tubes"};
        if (!mended_.openings.empty() || *ways > 1) return {};
        const Vec3 tip = ends.front().centre; // back from there: the first search began at an end, where the vessel is widest
        const Result<std::size_t> back = add_tips_from(tip, ends);
        return back.ok() ? Result<void>() : back.error();
    }

    /// Tips that are not among the ends yet. Returns how many branches leave the start: one, if it is an end.
    Result<std::size_t> add_tips_from(const Vec3& start, std::vector<VesselEnd>& ends) {
        const Result<std::vector<CentrelineBranch>> branches = find_branches(mended_.surface, lumen_, start, mended_.openings, Centring::None);
        if (!branches.ok()) return branches.error();
        for (const CentrelineBranch& branch : *branches) {
            if (!branch.ends) continue;
            const VesselEnd tip = tip_of(branch);
            const bool known = std::any_of(ends.begin(), ends.end(), [&](const VesselEnd& end) {
                return (end.centre - tip.centre).norm() < kEndReach * std::max(end.radius, tip.radius);
            });
            if (!known) ends.push_back(tip);
        }
        return static_cast<std::size_t>(std::count_if(branches->begin(), branches->end(), [](const CentrelineBranch& branch) { return branch.parent == kNoIndex; }));
    }

    /// Each branch that ends is an outlet: of the opening that it comes to, or closed. Openings that none comes to get a branch.
    void name_ends(std::size_t inlet) {
        std::vector<VesselEnd> outlets;
        std::vector<Index> of_branch;
        std::vector<bool> reached(mended_.openings.size(), false);
        if (inlet < reached.size()) reached[inlet] = true;
        for (Index b = 0; b < made_.branches.size(); ++b) {
            if (!made_.branches[b].ends) continue;
            VesselEnd end = tip_of(made_.branches[b]);
            std::optional<std::size_t> best;
            for (std::size_t o = 0; o < reached.size(); ++o) {
                if (reached[o]) continue;
                const double away = (mended_.openings[o].centre - end.centre).norm();
                if (away < kEndReach * std::max(mended_.openings[o].radius, end.radius) &&
                    (!best || away < (mended_.openings[*best].centre - end.centre).norm()))
                    best = o;
            }
            if (best) end = mended_.openings[*best], reached[*best] = true;
            outlets.push_back(end);
            of_branch.push_back(b);
        }
        for (std::size_t o = 0; o < reached.size(); ++o)
            if (!reached[o]) add_way_to(mended_.openings[o], outlets, of_branch);
        sort_and_name(outlets, of_branch);
    }

    void add_way_to(const VesselEnd& opening, std::vector<VesselEnd>& outlets, std::vector<Index>& of_branch) {
        const auto path = spheretree::find_lumen_path(lumen_, made_.branches[0].points[0], place_behind(opening, inside_));
        if (!path.ok()) {
            made_.notes.push_back(fmt::format("an opening of radius {:.3g} mm cannot be reached from the inlet: {}", 1e3 * opening.radius,
                                              path.error().message));
            return;
        }
        Index parent = 0, at = 0;
        std::size_t begin = path->size();
        for (; begin > 0; --begin)
            if (find_near((*path)[begin - 1].centre, parent, at)) break;
        CentrelineBranch branch{{made_.branches[parent].points[at]}, {made_.branches[parent].radii[at]}, kNoIndex, true};
        for (; begin < path->size(); ++begin) {
            branch.points.push_back((*path)[begin].centre);
            branch.radii.push_back(-inside_.signed_distance((*path)[begin].centre));
        }
        if (branch.points.size() < 2) return;
        branch.parent = split_branch(parent, at, of_branch);
        made_.branches.push_back(std::move(branch));
        outlets.push_back(opening);
        of_branch.push_back(static_cast<Index>(made_.branches.size() - 1));
    }

    bool find_near(const Vec3& p, Index& branch, Index& point) const {
        double least = std::numeric_limits<double>::infinity();
        for (Index b = 0; b < made_.branches.size(); ++b)
            for (Index i = 0; i < made_.branches[b].points.size(); ++i) {
                const double away = (made_.branches[b].points[i] - p).norm();
                if (away < least) least = away, branch = b, point = i;
            }
        return least <= 0.5 * made_.branches[branch].radii[point];
    }

    /// So that a branch may leave at the point: what lies beyond becomes a branch of its own. Returns the part up to the point.
    Index split_branch(Index b, Index at, std::vector<Index>& of_branch) {
        if (at == 0) return made_.branches[b].parent;
        if (at + 1 >= made_.branches[b].points.size()) return b;
        CentrelineBranch& near = made_.branches[b];
        CentrelineBranch beyond{{near.points.begin() + at, near.points.end()}, {near.radii.begin() + at, near.radii.end()}, b, near.ends};
        near.points.resize(at + 1);
        near.radii.resize(at + 1);
        near.ends = false;
        const auto id = static_cast<Index>(made_.branches.size());
        for (CentrelineBranch& other : made_.branches)
            if (other.parent == b) other.parent = id;
        for (Index& known : of_branch)
            if (known == b) known = id;
        made_.branches.push_back(std::move(beyond));
        return b;
    }

    void sort_and_name(const std::vector<VesselEnd>& outlets, const std::vector<Index>& of_branch) {
        std::vector<std::size_t> order(outlets.size());
        for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
        std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return wider(outlets[a], outlets[b]); });
        made_.ends[0].name = "inlet";
        for (std::size_t k = 0; k < order.size(); ++k) {
            made_.ends.push_back(outlets[order[k]]);
            made_.ends.back().name = fmt::format("outlet_{}", k + 1);
            made_.end_branch.push_back(of_branch[order[k]]);
        }
    }

    MendedVessel mended_;
    const VesselOptions& options_;
    spheretree::LumenTree lumen_;
    InsideTest inside_;
    ImportedVessel made_;
};

} // namespace

Result<ImportedVessel> import_vessel(TriMesh raw, const VesselOptions& options, const std::function<void(const std::string&)>& progress) {
    const auto tell = [&](const char* what) {
        if (progress) progress(what);
    };
    tell("mending the surface");
    Result<MendedVessel> mended = mend_vessel(std::move(raw), options.mode, options.inlet);
    if (!mended.ok()) return mended.error();
    mended->openings.insert(mended->openings.end(), options.openings.begin(), options.openings.end());
    tell("looking for the lumen's inscribed spheres");
    Result<spheretree::LumenTree> lumen = spheretree::build_lumen_tree(mended->surface);
    if (!lumen.ok())
        return Error{lumen.error().code, lumen.error().message + "; --unit says what the file's coordinates are measured in"};
    tell("finding the centreline");
    return VesselImporter(std::move(*mended), options, std::move(*lumen)).run();
}

} // namespace trocar::engine
