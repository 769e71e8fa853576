#include "engine/step/contact/contact_solver.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// [-], of the largest impulse: an iteration that changes none by more has converged; after so many, one that changes none by more than the
/// second: the rest goes on in the next sub-step, from its warm start.
constexpr double kTolerance = 1e-3, kLateTolerance = 3e-3;
constexpr unsigned kLate = 20;
/// [-], of the mobility of sides that share no node: with less the two are moved by the same nodes, which no impulse takes apart. What would
/// part them a little would throw those nodes.
constexpr double kTogether = 1e-2;
/// m/s; slower than this is no motion.
constexpr double kStill = 1e-7;
/// m/s; what lies in another body creeps out at this speed whatever contact has taken before.
constexpr double kCreep = 5e-5;
/// m/s^2, s; what an assumed contact stops, and how fast: one that stood for nothing must not crush what is between it and the next.
constexpr double kHoldWeight = 2.0 * 9.81, kHoldOnFixed = 6.0 * 9.81, kStopping = 5e-3;
/// Cosine. What moves more along the normal than that leaves, and nothing holds it.
constexpr double kLeaving = 0.5;
/// Of the holds of wholes among one another.
constexpr unsigned kHoldIterations = 10;
/// In a sub-step, of solves with the places that the one before brought together. What is left after them stands in the next sub-step.
constexpr unsigned kMostRounds = 4;

Vec3 position_of(const fem::NodeRecord& node) noexcept { return Vec3(node.x[0], node.x[1], node.x[2]); }

Vec3 velocity_of(const fem::NodeRecord& node) noexcept { return Vec3(node.v[0], node.v[1], node.v[2]); }

/// visit(node, kg) of those that can move.
template <class Visit>
void for_each_free(const GivingBody& body, Visit&& visit) {
    for (std::size_t n = 0; n < body.nodes.size(); ++n)
        if (body.inv_mass[n] > 0.0) visit(body.nodes[n], 1.0 / body.inv_mass[n]);
}

/// Its motion as if it were rigid, in one pass: moments about its first node, so that little cancels.
void find_motion(GivingBody& body) noexcept {
    body.mass = body.stopped = 0.0;
    body.change.setZero();
    if (body.nodes.empty()) return;
    const Vec3 from = position_of(body.nodes[0]);
    Vec3 first = Vec3::Zero(), momentum = Vec3::Zero(), angular = Vec3::Zero();
    double mass_sum = 0.0, xx = 0.0, yy = 0.0, zz = 0.0, xy = 0.0, yz = 0.0, zx = 0.0; // in registers: a matrix would be a chain through memory
    for_each_free(body, [&](const fem::NodeRecord& node, double mass) {
        const Vec3 arm = position_of(node) - from, push = mass * velocity_of(node), moment = mass * arm;
        mass_sum += mass;
        first += moment;
        xx += moment.x() * arm.x(), yy += moment.y() * arm.y(), zz += moment.z() * arm.z();
        xy += moment.x() * arm.y(), yz += moment.y() * arm.z(), zx += moment.z() * arm.x();
        momentum += push;
        angular += arm.cross(push);
    });
    body.mass = mass_sum;
    Mat3 second;
    second << xx, xy, zx, xy, yy, yz, zx, yz, zz;
    if (!(body.mass > 0.0)) return;
    const Vec3 centre = first / body.mass;
    body.centre = from + centre;
    body.velocity = momentum / body.mass;
    second -= first * centre.transpose();
    const Mat3 inertia = second.trace() * Mat3::Identity() - second;
    body.turning = inertia.ldlt().solve(angular - centre.cross(momentum));
    if (!is_finite(body.turning)) body.turning.setZero(); // all on a line, or in one place
}

/// What holding it as a whole came to, to all of its nodes.
void change_motion(const GivingBody& body) noexcept {
    const Vec3 turning = body.stopped * body.turning;
    for_each_free(body, [&](fem::NodeRecord& node, double) {
        const Vec3 change = body.change - turning.cross(position_of(node) - body.centre);
        for (int axis = 0; axis < 3; ++axis) node.v[axis] += change[axis];
    });
}

} // namespace

void ContactSolver::reserve(std::size_t rows, std::size_t bodies) {
    bounds_.reserve(rows, bodies);
    flags_.reserve(rows);
    near_.reserve(rows);
}

void ContactSolver::begin(std::span<ContactRow> rows, std::span<GivingBody> bodies) {
    rows_ = rows;
    bodies_ = bodies;
    most_rows_ = std::numeric_limits<std::uint64_t>::max();
    wholes_ = 0;
    bounds_.begin(rows, bodies.size());
    flags_.clear();
    near_.clear();
    for (ContactRow& row : rows_) {
        wholes_ += row.is_whole();
        row.sum.setZero();
        row.entries = 0;
        flags_.push_back({.presses = !row.impulse.isZero(0.0), .whole = row.is_whole()});
    }
}

/// Those that press, or may meet within `h` s.
void ContactSolver::list_near(double h) noexcept {
    bounds_.find_speeds(bodies_);
    near_.clear();
    for (Index k = 0; k < flags_.size(); ++k) {
        Flags& flags = flags_[k];
        flags.was_near = flags.near;
        flags.near = flags.whole || flags.presses || bounds_.may_close(k, h);
        if (flags.near) near_.push_back(k);
        if (flags.was_near && !flags.near) rows_[k].mobility = 0.0;
    }
}

/// Nodes that several feet stand on, of both sides even, are one entry each.
void ContactSolver::number_entries(ContactRow& row) noexcept {
    row.entries = 0;
    const ContactSide* sides[2] = {&row.a, &row.b};
    for (std::size_t side = 0; side < 2; ++side)
        for (std::size_t foot = 0; foot < sides[side]->feet; ++foot)
            for (std::size_t k = 0; k < 4; ++k) {
                std::size_t at = 0;
                while (at < row.entries &&
                       !(row.entry[at].slot == sides[side]->slot && row.entry[at].record == sides[side]->record[foot][k]))
                    ++at;
                if (at == row.entries) row.entry[row.entries++] = {sides[side]->slot, sides[side]->record[foot][k]};
                row.entry_of[side][foot][k] = static_cast<std::uint8_t>(at);
            }
}

/// Both bodies feel the impulse at a's place: the feet of b are moved there together.
void ContactSolver::place(ContactRow& row) const noexcept {
    if (row.entries == 0) number_entries(row);
    for (std::size_t k = 0; k < row.entries; ++k) row.entry[k].weight = 0.0;
    double apart = 0.0; // 1/kg, the mobility of sides that share no node
    const auto add = [&](std::size_t side, const ContactSide& of, std::size_t foot, std::size_t k, double weight) {
        row.entry[row.entry_of[side][foot][k]].weight += weight;
        apart += weight * weight * bodies_[of.slot].inv_mass[of.record[foot][k]];
    };
    for (std::size_t foot = 0; foot < row.a.feet; ++foot)
        for (std::size_t k = 0; k < 4; ++k) add(0, row.a, foot, k, row.a.blend * row.a.share[foot] * row.a.weight[foot][k]);
    Vec3 aside = Vec3::Zero();
    const auto of_b = [&](Index n) { return position_of(bodies_[row.b.slot].nodes[n]); };
    if (row.a.gives() && row.b.gives())
        aside = row.a.image([&](Index n) { return position_of(bodies_[row.a.slot].nodes[n]); }) - row.b.image(of_b);
    for (std::size_t foot = 0; foot < row.b.feet; ++foot) {
        double weight[4];
        std::copy_n(row.b.weight[foot], 4, weight);
        if (row.a.gives()) {
            const Index* n = row.b.record[foot];
            const Vec3 x[4] = {of_b(n[0]), of_b(n[1]), of_b(n[2]), of_b(n[3])};
            (void)fem::find_affine(x, row.b.image(foot, of_b) + aside, weight);
        }
        for (std::size_t k = 0; k < 4; ++k) add(1, row.b, foot, k, -row.b.blend * row.b.share[foot] * weight[k]);
    }
    row.mobility = 0.0;
    for (std::size_t k = 0; k < row.entries; ++k) {
        ContactRow::Entry& entry = row.entry[k];
        entry.per_mass = entry.weight * bodies_[entry.slot].inv_mass[entry.record];
        row.mobility += entry.weight * entry.per_mass;
    }
    if (row.mobility < kTogether * apart) row.mobility = 0.0;
}

/// m/s, of a against b at the place where the impulse acts.
Vec3 ContactSolver::velocity(const ContactRow& row) const noexcept {
    double u[3] = {};
    for (std::size_t k = 0; k < row.entries; ++k) {
        const ContactRow::Entry& entry = row.entry[k];
        const double* v = bodies_[entry.slot].nodes[entry.record].v;
        for (int axis = 0; axis < 3; ++axis) u[axis] += entry.weight * v[axis];
    }
    return Vec3(u[0], u[1], u[2]) + (row.a.velocity - row.b.velocity);
}

void ContactSolver::push(const ContactRow& row, const Vec3& impulse) const noexcept {
    for (std::size_t k = 0; k < row.entries; ++k) {
        const ContactRow::Entry& entry = row.entry[k];
        double* v = bodies_[entry.slot].nodes[entry.record].v;
        for (int axis = 0; axis < 3; ++axis) v[axis] += entry.per_mass * impulse[axis];
    }
}

double ContactSolver::gap_at(const ContactRow& row, double time) const noexcept {
    Vec3 moved = time * (row.a.velocity - row.b.velocity);
    if (row.a.gives()) moved += row.a.blend * (row.a.image([&](Index n) { return position_of(bodies_[row.a.slot].nodes[n]); }) - row.a.start);
    if (row.b.gives()) moved -= row.b.blend * (row.b.image([&](Index n) { return position_of(bodies_[row.b.slot].nodes[n]); }) - row.b.start);
    return row.gap + row.normal.dot(moved);
}

/// One place to where it satisfies its conditions, the others as they are. returns  N s, by how much its impulse has changed
double ContactSolver::relax(ContactRow& row) const noexcept {
    const Vec3 u = velocity(row);
    const double speed = row.normal.dot(u), held = row.normal.dot(row.impulse);
    const double normal = std::max(0.0, held + (row.target - speed) / row.mobility);
    Vec3 along = row.impulse - held * row.normal;
    if (row.friction > 0.0) {
        along -= (u - speed * row.normal) / row.mobility;
        const double length = along.norm(), most = row.friction * normal;
        if (length > most) along *= most / length;
    } else {
        along.setZero();
    }
    const Vec3 now = normal * row.normal + along, change = now - row.impulse;
    row.impulse = now;
    push(row, change);
    return change.norm();
}

/// Places that press or would be passed, until they rest; then all of them once more, until none of the others wants to press. Between two
/// passes impulses go on as those before have changed them, as far as the changes shrink (nonsmooth nonlinear conjugate gradients,
/// Silcowitz-Hansen, Niebe & Erleben 2010); a pass comes last, and leaves every impulse in its cone.
/// done   iterations of the sub-step so far
ContactSolve ContactSolver::iterate(unsigned done) noexcept {
    ContactSolve solve{.iterations = done, .converged = false};
    const unsigned limit = std::max(most_iterations(), done + kLeastIterations);
    double before = 0.0; // J, what the pass before changed; 0: none that this one could go on from
    for (bool all = true;;) {
        double largest = 0.0, fastest = 0.0, most = 0.0, changed = 0.0;
        for (const Index k : near_) {
            ContactRow& row = rows_[k];
            if (!(row.mobility > 0.0) || !(all || row.active)) continue;
            const Vec3 from = row.impulse;
            const double change = relax(row);
            row.change = row.impulse - from;
            changed += row.mobility * change * change;
            largest = std::max(largest, change);
            fastest = std::max(fastest, change * row.mobility);
            most = std::max(most, row.impulse.norm());
            row.active = !row.impulse.isZero(0.0);
        }
        ++solve.iterations;
        solve.relaxed += near_.size();
        solve.residual = largest;
        const double tolerance = solve.iterations < kLate ? kTolerance : kLateTolerance;
        const bool rests = !(largest > tolerance * most) || fastest < kStill;
        solve.converged = rests && all;
        if (solve.converged || solve.iterations >= limit) return solve;
        const double share = before > 0.0 && changed < before ? changed / before : 0.0;
        for (const Index k : near_) {
            ContactRow& row = rows_[k];
            if (!row.active || !(row.mobility > 0.0)) continue;
            const Vec3 along = share * row.direction;
            row.direction = along + row.change;
            if (rests || share == 0.0) continue;
            row.impulse += along;
            push(row, along);
        }
        before = rests ? 0.0 : changed;
        all = rests;
    }
}

/// A solve that ended before it had converged may have given more than contact has taken: then all of its impulses are made smaller together,
/// which keeps both momenta. With a share s of them the work is s a + s^2 b.
void ContactSolver::limit_energy(double most) noexcept {
    double a = 0.0, b = 0.0; // J
    for (const Index k : near_) {
        const ContactRow& row = rows_[k];
        if (row.is_whole()) continue;
        a += 0.5 * row.impulse.dot(row.before + row.kicked);
        b += 0.5 * row.impulse.dot(velocity(row) - row.kicked);
    }
    if (!(a + b > most)) return;
    const double share = b > 0.0 ? std::clamp((std::sqrt(a * a + 4.0 * b * most) - a) / (2.0 * b), 0.0, 1.0) : 0.0;
    for (const Index k : near_) {
        ContactRow& row = rows_[k];
        if (row.is_whole()) continue;
        push(row, (share - 1.0) * row.impulse);
        row.impulse *= share;
    }
}

/// Once a sub-step, after its last iteration.
ContactSolve ContactSolver::note_work(ContactSolve solve) noexcept {
    for (const Index k : near_) {
        ContactRow& row = rows_[k];
        row.sum += row.impulse;
        flags_[k].presses = !row.impulse.isZero(0.0);
        if (row.is_whole()) continue;
        const Vec3 after = velocity(row);
        solve.work += 0.5 * row.impulse.dot(row.before + after);
        row.before = after;
    }
    return solve;
}

void ContactSolver::observe() noexcept {
    list_near(0.0);
    for (const Index k : near_) {
        if (flags_[k].whole) continue;
        place(rows_[k]);
        rows_[k].before = velocity(rows_[k]);
    }
}

/// Gives so much of the rows' impulses to the bodies.
void ContactSolver::start(double share) const noexcept {
    for (const Index k : near_)
        if (rows_[k].mobility > 0.0) push(rows_[k], share * rows_[k].impulse);
}

unsigned ContactSolver::most_iterations() const noexcept {
    const std::uint64_t rows = most_rows_ - std::min<std::uint64_t>(most_rows_, rows_.size());
    return static_cast<unsigned>(std::clamp<std::uint64_t>(rows / std::max<std::size_t>(1, near_.size()), kLeastIterations, kMostIterations));
}

/// The wholes among the rows, their mean motion alone.
void ContactSolver::hold_wholes(double h) const noexcept {
    if (wholes_ == 0) return;
    for (GivingBody& body : bodies_) body.mass = 0.0;
    for (ContactRow& row : rows_) {
        if (!row.is_whole()) continue;
        row.impulse.setZero();
        for (const ContactSide* side : {&row.a, &row.b})
            if (side->gives() && bodies_[side->slot].mass == 0.0) find_motion(bodies_[side->slot]);
    }
    double fastest = std::numeric_limits<double>::infinity();
    for (unsigned k = 0; k < kHoldIterations && fastest > kStill; ++k) {
        fastest = 0.0;
        for (ContactRow& row : rows_)
            if (row.is_whole()) fastest = std::max(fastest, hold_whole(row, h));
    }
    for (const GivingBody& body : bodies_)
        if (body.mass > 0.0) change_motion(body);
}

/// One of them, the others as they are. returns   m/s, by how much the two have changed against one another
double ContactSolver::hold_whole(ContactRow& row, double h) const noexcept {
    const auto held = [&](const ContactSide& side) { return side.gives() && bodies_[side.slot].mass > 0.0 ? &bodies_[side.slot] : nullptr; };
    GivingBody *const a = held(row.a), *const b = held(row.b);
    if (a == nullptr && b == nullptr) return 0.0;
    const bool is_fixed = a == nullptr || b == nullptr;
    const Vec3 between = is_fixed ? row.normal : Vec3(a->centre - b->centre);
    const double length = between.norm();
    const Vec3 normal = length > 0.0 ? Vec3(between / length) : row.normal;
    const auto velocity_of = [](const GivingBody* body, const ContactSide& side) { return body != nullptr ? Vec3(body->velocity + body->change) : side.velocity; };
    const Vec3 u = velocity_of(a, row.a) - velocity_of(b, row.b);
    if (is_fixed && row.impulse.isZero(0.0) && normal.dot(u) > kLeaving * u.norm()) return 0.0;
    const double mobility = (a != nullptr ? 1.0 / a->mass : 0.0) + (b != nullptr ? 1.0 / b->mass : 0.0);
    const double speed = is_fixed ? u.norm() : std::max(0.0, -normal.dot(u));
    const double within = std::min(kStopping, row.room / std::max(speed, kStill)); // s
    // what a first iteration allowed later ones do: they see what it left
    const double most =
        std::max(row.impulse.norm(), ((is_fixed ? kHoldOnFixed : kHoldWeight) * h + speed * std::min(1.0, h / within)) / mobility);
    Vec3 now = is_fixed ? Vec3(row.impulse - u / mobility)
                        : Vec3(std::max(0.0, row.impulse.dot(normal) - normal.dot(u) / mobility) * normal);
    const double share = std::min(1.0, most / std::max(now.norm(), std::numeric_limits<double>::min()));
    now *= share;
    if (is_fixed) {
        GivingBody& body = a != nullptr ? *a : *b;
        body.stopped = std::max(body.stopped, share);
    }
    const Vec3 change = now - row.impulse;
    row.impulse = now;
    if (a != nullptr) a->change += change / a->mass;
    if (b != nullptr) b->change -= change / b->mass;
    return change.norm() * mobility;
}

/// Where those near act in this sub-step, and what speed they ask for; wholes are held first. Their impulses are given to no body yet.
void ContactSolver::prepare_rows(double h, double fastest) noexcept {
    for (const Index k : near_) {
        ContactRow& row = rows_[k];
        if (row.is_whole()) continue;
        place(row);
        if (!flags_[k].was_near) row.before = velocity(row);
        row.kicked = velocity(row);
        row.target = row.now > 0.0 ? -row.now / h : std::min({row.recovery, -row.now / h, fastest});
        row.active = false;
        if (!(row.mobility > 0.0)) row.impulse.setZero();
    }
}

/// Rows that the velocities which the solve came to take together after all: they are solved with the others, from the impulses that those came
/// to. False: none, and the speeds are those that the bodies have now.
bool ContactSolver::add_passed(double time, double h, double fastest) noexcept {
    bounds_.find_speeds(bodies_);
    bool any = false;
    for (Index k = 0; k < flags_.size(); ++k) {
        if (flags_[k].near || !bounds_.may_close(k, h)) continue;
        flags_[k].near = any = true;
        rows_[k].now = gap_at(rows_[k], time);
    }
    if (!any) return false;
    start(-1.0);
    near_.clear();
    for (Index k = 0; k < flags_.size(); ++k)
        if (flags_[k].near) near_.push_back(k);
    prepare_rows(h, fastest);
    start();
    return true;
}

ContactSolve ContactSolver::approach(double time, double h, double ratio, double spare) noexcept {
    list_near(h);
    double wanted = 0.0; // J, at most, that pushing out gives
    for (const Index k : near_) {
        ContactRow& row = rows_[k];
        row.impulse *= ratio;
        if (row.is_whole()) continue;
        row.now = gap_at(row, time);
        if (row.now < 0.0) wanted += row.normal.dot(row.impulse) * row.recovery;
    }
    const double fastest = spare > 2.0 * wanted ? std::numeric_limits<double>::infinity() : kCreep;
    hold_wholes(h);
    prepare_rows(h, fastest);
    start();
    ContactSolve solve = iterate(0);
    solve.relaxed += rows_.size();
    bool passed = add_passed(time, h, fastest);
    for (unsigned round = 1; passed && round < kMostRounds; ++round) {
        const ContactSolve again = iterate(solve.iterations);
        solve = {.iterations = again.iterations, .relaxed = solve.relaxed + again.relaxed, .converged = again.converged, .residual = again.residual};
        passed = add_passed(time, h, fastest);
    }
    solve.converged = solve.converged && !passed;
    if (!solve.converged) {
        limit_energy(std::max(0.0, spare));
        bounds_.find_speeds(bodies_);
    }
    for (const Index k : near_) bounds_.set(k, rows_[k].now);
    bounds_.advance(h);
    return note_work(solve);
}

ContactSolve ContactSolver::settle(double time) noexcept {
    list_near(0.0);
    for (const Index k : near_) {
        ContactRow& row = rows_[k];
        if (row.is_whole()) {
            row.last.setZero();
            row.impulse.setZero();
            continue;
        }
        const bool presses = row.normal.dot(row.impulse) > 0.0 || !(gap_at(row, time) > 0.0);
        row.last = row.impulse;
        row.impulse *= 0.5;
        place(row);
        if (!flags_[k].was_near) row.before = velocity(row);
        if (!presses || !(row.mobility > 0.0)) {
            row.mobility = 0.0;
            row.impulse.setZero();
            continue;
        }
        row.target = 0.0;
    }
    start();
    ContactSolve solve = iterate(0);
    solve.relaxed += rows_.size();
    return note_work(solve);
}

} // namespace trocar::engine
