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

#include "engine/step/contact/gap_bounds.hpp"

#include <cstdint>
#include <algorithm>
#include <limits>
#include <span>
#include <vector>

namespace trocar::engine {

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
    /// Of a row, apart from it.
    struct Flags {
        bool presses = false;                // its impulse is not 0
        bool near = false, was_near = false; // this sub-step solves it; the last one did
        bool whole = false;
    };

    void list_near(double h) noexcept;
    [[nodiscard]] bool add_passed(double time, double h, double fastest) noexcept;
    [[nodiscard]] unsigned most_iterations() const noexcept;
    void prepare_rows(double h, double fastest) noexcept;
    void limit_energy(double most) noexcept;
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
    GapBounds bounds_;
    std::vector<Flags> flags_; // [rows]
    std::vector<Index> near_;  // rows that the sub-step in hand solves, ascending
    std::uint64_t most_rows_ = std::numeric_limits<std::uint64_t>::max();
    std::size_t wholes_ = 0;
};

} // namespace trocar::engine
