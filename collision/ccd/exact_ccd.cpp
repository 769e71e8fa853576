#include "collision/ccd/exact_ccd.hpp"

#include "collision/ccd/exact_roots.hpp"

#include <algorithm>

namespace trocar::collision {
namespace {

constexpr int kTimeBits = 48; // of a reported root

using Polynomial3 = std::array<Polynomial, 3>; // a vector whose coordinates are polynomials in time

Polynomial dot(const Polynomial3& a, const Polynomial3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Polynomial3 cross(const Polynomial3& a, const Polynomial3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// The power of two of which every coordinate is a multiple.
template <std::size_t Count>
int common_exponent(const std::array<const SweptPoint*, Count>& points) noexcept {
    int exponent = std::numeric_limits<int>::max();
    for (const SweptPoint* p : points)
        for (int axis = 0; axis < 3; ++axis) exponent = std::min({exponent, lowest_exponent(p->t0[axis]), lowest_exponent(p->t1[axis])});
    return exponent == std::numeric_limits<int>::max() ? 0 : exponent;
}

Polynomial3 difference(const SweptPoint& a, const SweptPoint& b, int exponent) {
    Polynomial3 out;
    for (int axis = 0; axis < 3; ++axis) {
        const BigInteger from = BigInteger::from_double(a.t0[axis], exponent) - BigInteger::from_double(b.t0[axis], exponent);
        const BigInteger to = BigInteger::from_double(a.t1[axis], exponent) - BigInteger::from_double(b.t1[axis], exponent);
        out[static_cast<std::size_t>(axis)].coefficient = {from, to - from, {}, {}};
    }
    return out;
}

template <std::size_t Count>
class Polygon {
public:
    explicit Polygon(const std::array<Polynomial3, Count>& corner) : corner_(corner) {
        for (std::size_t k = 0; k < Count; ++k) cross_[k] = cross(corner_[k], corner_[(k + 1) % Count]);
    }

    std::optional<double> first_time() {
        const Polynomial plane = dot(cross_[0], corner_[Count - 1]);
        if (plane.is_zero()) return first_time_in_plane();
        RootList list(plane);
        for (Root& root : list.roots())
            if (is_inside(list, root) || is_on_border(list, root)) return report(list, root);
        return std::nullopt;
    }

private:
    static double report(const RootList& list, Root& root) {
        list.refine(root, kTimeBits);
        return root.value();
    }

    bool is_inside(const RootList& list, Root& root) const {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const int sign = list.sign_at(root, cross_[0][axis]);
            bool same = sign != 0;
            for (std::size_t k = 1; k < Count && same; ++k) same = list.sign_at(root, cross_[k][axis]) == sign;
            if (same) return true;
            if (sign != 0) return false; // the plane is not parallel to this axis, so this axis decides
        }
        return false;
    }

    bool is_on_border(const RootList& list, Root& root) const {
        for (std::size_t k = 0; k < Count; ++k) {
            bool on_line = true;
            for (std::size_t axis = 0; axis < 3 && on_line; ++axis) on_line = list.sign_at(root, cross_[k][axis]) == 0;
            if (on_line && list.sign_at(root, dot(corner_[k], corner_[(k + 1) % Count])) <= 0) return true;
        }
        return false;
    }

    /// Motion within one plane that holds the origin.
    std::optional<double> first_time_in_plane() const {
        RootList start(Polynomial{{BigInteger(0), BigInteger(1), {}, {}}}); // t = 0
        Root& zero = start.roots()[0];
        if (is_inside(start, zero) || is_on_border(start, zero)) return 0.0;
        std::optional<double> first;
        for (std::size_t k = 0; k < Count; ++k) {
            const std::optional<double> time = first_time_on_side(k);
            if (time && (!first || *time < *first)) first = time;
        }
        return first;
    }

    std::optional<double> first_time_on_side(std::size_t k) const {
        const Polynomial between = dot(corner_[k], corner_[(k + 1) % Count]);
        const auto& line = cross_[k];
        const auto moving = std::find_if(line.begin(), line.end(), [](const Polynomial& p) { return !p.is_zero(); });
        if (moving == line.end()) { // the origin stays on the side's line: it is met at an end of the side
            if (between.is_zero()) return 0.0;
            RootList list(between);
            if (list.roots().empty()) return std::nullopt;
            return report(list, list.roots()[0]);
        }
        RootList list(*moving);
        for (Root& root : list.roots()) {
            const bool on_line = std::all_of(line.begin(), line.end(), [&](const Polynomial& p) { return list.sign_at(root, p) == 0; });
            if (on_line && list.sign_at(root, between) <= 0) return report(list, root);
        }
        return std::nullopt;
    }

    std::array<Polynomial3, Count> corner_;
    std::array<Polynomial3, Count> cross_;
};

} // namespace

std::optional<double> find_exact_time(const SweptPoint& vertex, const std::array<SweptPoint, 3>& face) {
    const int exponent = common_exponent<4>({&vertex, &face[0], &face[1], &face[2]});
    return Polygon<3>({difference(vertex, face[0], exponent), difference(vertex, face[1], exponent), difference(vertex, face[2], exponent)})
        .first_time();
}

std::optional<double> find_exact_time(const std::array<SweptPoint, 2>& a, const std::array<SweptPoint, 2>& b) {
    const int exponent = common_exponent<4>({&a[0], &a[1], &b[0], &b[1]});
    return Polygon<4>({difference(a[0], b[0], exponent), difference(a[1], b[0], exponent), difference(a[1], b[1], exponent),
                       difference(a[0], b[1], exponent)})
        .first_time();
}

} // namespace trocar::collision
