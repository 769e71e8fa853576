// Contact between solids in a sub-step: impulses at the places where they touch, equal and opposite at one instant.
//
// Velocity-level time stepping with lumped masses. With v the nodes' velocities after the kick of the internal forces, gap g of a place and
// its rate n . u:   v+ = v + M^-1 G^T lambda,   0 <= lambda_n  _|_  g + h n . u(v+) >= 0,   |lambda_t| <= mu lambda_n, against the slip.
// Projected Gauss-Seidel, warm-started with the impulses of the last sub-step. Each iteration gives one impulse to both sides: a solve that
// ends early keeps momentum and angular momentum, and what it leaves is a speed of approach that can be told.
//
// This work is based on: Moreau 1988; Jean 1999, "The non-smooth contact dynamics method"; Stewart & Trinkle 1996.
// A place is solved where it presses or could come together within the sub-step: the others are seen by a lower bound of their gap alone,
// which falls by what the velocities of the two bodies differ by at most, and is checked against the velocities that the solve came to.
//
// Deviations: a place follows the tetrahedron beneath it (an affine image of four nodes) within a step, and both bodies feel the impulse at
// the first one's place: forces have no moment together, friction's included, and the local problem is a scalar, W = sum w_i^2 / m_i.
// What the nodes of a place have of kinetic energy towards the other body is lost when they meet: a body's share of that falls with the
// size of its elements.
#pragma once

#include "base/contact.hpp"
#include "fem/tissue/force_plan.hpp"

#include <cstdint>
#include <algorithm>
#include <limits>
#include <span>
#include <vector>

namespace trocar::engine {

/// A body whose nodes contact moves, while it is advanced.
struct GivingBody {
    std::span<fem::NodeRecord> nodes; // in the plan's order
    const double* inv_mass = nullptr; // [nodes] 1/kg

    // of its nodes that can move, in the sub-step in hand: what holds it as a whole sees no more of it
    double mass = 0.0; // kg; 0: nothing holds it
    Vec3 centre = Vec3::Zero(), velocity = Vec3::Zero(), change = Vec3::Zero(); // m, m/s, m/s
    Vec3 turning = Vec3::Zero(); // rad/s, as if it were rigid
    double stopped = 0.0; // [-] of its turning, that goes with what is stopped of its velocity against what stands still
};

/// A place of one of the two bodies: an affine image of the tetrahedron beneath it, or, where its triangle or edge is longer than those, the
/// mean of its corners' images.
struct ContactSide {
    static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
    static constexpr std::size_t kMostFeet = 3;
    std::uint32_t slot = kNone;       // of the giving bodies; kNone: it stands still, or goes its scripted way
    std::size_t owner = 0;            // the body whose nodes carry it
    std::size_t feet = 0;             // 0: no node carries it
    double share[kMostFeet] = {};     // [feet] sum 1
    Index record[kMostFeet][4] = {};  // [feet] of the owner's tetrahedra
    double weight[kMostFeet][4] = {}; // [feet] affine coordinates at the step's start; sum 1
    double blend = 1.0;               // [-] of its tetrahedra's motion
    Vec3 start = Vec3::Zero();        // m, its image then
    Vec3 velocity = Vec3::Zero();     // m/s, of what no node carries

    [[nodiscard]] bool gives() const noexcept { return feet > 0; }
    /// position(record)
    template <class Position>
    [[nodiscard]] Vec3 image(std::size_t foot, Position&& position) const {
        Vec3 sum = Vec3::Zero();
        for (std::size_t k = 0; k < 4; ++k) sum += weight[foot][k] * position(record[foot][k]);
        return sum;
    }
    template <class Position>
    [[nodiscard]] Vec3 image(Position&& position) const {
        Vec3 sum = Vec3::Zero();
        for (std::size_t foot = 0; foot < feet; ++foot) sum += share[foot] * image(foot, position);
        return sum;
    }
};

struct ContactRow {
    ContactSide a, b;
    Vec3 normal = Vec3::UnitX(); // unit, from b to a
    double gap = 0.0;            // m, at the step's start
    double recovery = 0.0;       // m/s, at which what lies in the other one is pushed out
    double friction = 0.0;       // Coulomb's
    /// m; above 0 it is no place. The two are held as wholes, for what nobody looked at between them: their mean velocities come no nearer along
    /// the line of their mass centres, by one change of velocity for all nodes of each, which turns and deforms nothing. Where one of them does
    /// not give, the other neither slides nor turns. Approach ends within so much.
    double room = 0.0;
    [[nodiscard]] bool is_whole() const noexcept { return room > 0.0; }
    Vec3 impulse = Vec3::Zero(); // N s, on a, of the last sub-step
    Vec3 last = Vec3::Zero();    // N s, the same of the last whole sub-step: what the next step starts with
    Vec3 sum = Vec3::Zero();     // N s, on a, of the step
    /// m/s, of a against b after the last sub-step: before the kick and the impulses of this one; of a row that this one is the first to solve,
    /// after the kick
    Vec3 before = Vec3::Zero();

    /// What a node moves by an impulse, and what its motion is of the relative velocity.
    struct Entry {
        std::uint32_t slot;
        Index record;
        double weight = 0.0;   // [-] of a's less of b's
        double per_mass = 0.0; // 1/kg, the same over the node's mass
    };
    std::size_t entries = 0;
    Entry entry[2 * ContactSide::kMostFeet * 4];
    std::uint8_t entry_of[2][ContactSide::kMostFeet][4] = {}; // of a's and b's nodes

    // of the sub-step
    Vec3 change = Vec3::Zero(), way = Vec3::Zero(); // N s, of its impulse in the last pass, and in that and those before
    Vec3 kicked = Vec3::Zero(); // m/s, of a against b before its impulses
    double now = 0.0;      // m, its gap
    double mobility = 0.0; // 1/kg, W
    double target = 0.0;   // m/s, least speed of parting
    bool active = false;   // it pressed when it was relaxed last
};

struct ContactSolve {
    unsigned iterations = 0;
    std::uint64_t relaxed = 0; // rows times iterations, and every row once: all of them are looked over
    bool converged = true;
    double residual = 0.0; // N s, what the worst place still wants
    double work = 0.0;     // J, what the bodies' kinetic energy has changed by
};

class ContactSolver {
public:
    /// So many rows and bodies allocate nothing.
    void reserve(std::size_t rows, std::size_t bodies);

    /// rows and bodies outlive the step; friction's and normal impulses of the rows are those of a sub-step of `last` s before, or 0.
    void begin(std::span<ContactRow> rows, std::span<GivingBody> bodies);

    /// Notes how the bodies move before the first kick: what contact takes is counted from there.
    void observe() noexcept;

    /// The places of a sub-step of `h` s that begins `time` s after the step's start; their impulses are those of the last, by `ratio`.
    /// Changes the bodies' velocities. cost: the rows, once an iteration, no allocation.
    /// spare   J, what contact has taken from the bodies so far: pushing out gives no more than that back, but for the slowest creep
    ContactSolve approach(double time, double h, double ratio, double spare) noexcept;

    /// Is a whole among the rows? What holding them costs grows with their bodies' nodes, and is no iteration's.
    [[nodiscard]] bool holds_wholes() const noexcept { return wholes_ > 0; }

    /// At the step's end: what presses has no speed of approach any more.
    ContactSolve settle(double time) noexcept;

    static constexpr unsigned kLeastIterations = 4, kMostIterations = 40;
    /// Rows times iterations that each solve from now on may take (`relaxed`), if they are enough for the least number of iterations. One that ends
    /// there says what it left.
    void limit_rows(std::uint64_t most) noexcept { most_rows_ = most; }

private:
    /// What tells from afar whether a row's sides may meet.
    struct Watch {
        Vec3 normal = Vec3::UnitX(), velocity = Vec3::Zero(); // m/s, of a against b, of what no node carries
        double clear = 0.0;                                   // m; the gap is no less
        double spread[2] = {};                                // [-] of each side, sum of its weights' sizes
        double blend[2] = {};                                 // [-] of each side
        std::uint32_t slot[2] = {ContactSide::kNone, ContactSide::kNone};
        bool presses = false, near = false, whole = false;
        bool begun = false; // `before` of its row is that of this sub-step's start
    };
    /// Velocities of a body's nodes: all within `apart` of `mean`, m/s.
    struct Speeds {
        Vec3 mean = Vec3::Zero();
        double apart = 0.0;
    };

    [[nodiscard]] static Watch watch(const ContactRow& row) noexcept;
    void find_speeds() noexcept;
    [[nodiscard]] double least_rate(const Watch& watch) const noexcept;
    void list_near(double h) noexcept;
    [[nodiscard]] bool add_passed(double time, double h, double fastest) noexcept;
    [[nodiscard]] unsigned most_iterations() const noexcept;
    void prepare_rows(double h, double fastest) noexcept;
    void give_no_more(double most) noexcept;
    ContactSolve note_work(ContactSolve solve) noexcept;
    static void number_entries(ContactRow& row) noexcept;
    void place(ContactRow& row) const noexcept;
    [[nodiscard]] Vec3 velocity(const ContactRow& row) const noexcept;
    void push(const ContactRow& row, const Vec3& impulse) const noexcept;
    [[nodiscard]] double gap_at(const ContactRow& row, double time) const noexcept;
    [[nodiscard]] double relax(ContactRow& row) const noexcept;
    void hold_wholes(double h) const noexcept;
    [[nodiscard]] double hold_whole(ContactRow& row, double h) const noexcept;
    void start(double share = 1.0) const noexcept;
    ContactSolve iterate(unsigned done) noexcept;

    std::span<ContactRow> rows_;
    std::span<GivingBody> bodies_;
    std::vector<Watch> watches_;  // [rows]
    std::vector<Index> near_;     // rows that the sub-step in hand solves, ascending
    std::vector<Speeds> speeds_;  // [bodies]
    std::uint64_t most_rows_ = std::numeric_limits<std::uint64_t>::max();
    std::size_t wholes_ = 0;
};

} // namespace trocar::engine
