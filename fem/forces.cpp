#include "fem/forces.hpp"

#include "fem/laws.hpp"

#include <cmath>

namespace seldinger::fem {

namespace {

/// Dm^-1 and the rest volume of the tets first .. first + lanes - 1.
template <class T> struct Shape { Block<T> inverse; T volume; };

template <class T> inline Shape<T> load_shape(const TissueModel& model, std::size_t first) noexcept {
    const TetShape* tet = model.tet_shape.data() + first;
    Shape<T> shape;
    for (int i = 0; i < 9; ++i) shape.inverse.m[i] = make_lanes<T>([&](int lane) { return tet[lane].inverse[i]; });
    shape.volume = make_lanes<T>([&](int lane) { return tet[lane].volume; });
    return shape;
}

/// sum_a v_a (x) grad_a = [v1 - v0, v2 - v0, v3 - v0] Dm^-1 of any nodal vector.
template <class T>
inline Block<T> find_gradient(const TissueModel& model, std::size_t first, const Shape<T>& shape,
                              std::span<const Vec3> nodal) noexcept {
    const Tet* tet = model.tet_nodes.data() + first;
    Block<T> edges;
    for (std::size_t k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i)
            edges.m[3 * i + static_cast<int>(k)] =
                make_lanes<T>([&](int lane) { return nodal[tet[lane][k + 1]].data()[i] - nodal[tet[lane][0]].data()[i]; });
    return product(edges, shape.inverse);
}

/// Adds sign V P grad_a to every node; the four sum to zero by construction, so that momentum is kept to rounding.
template <class T>
inline void scatter(const TissueModel& model, std::size_t first, const Shape<T>& shape, const Block<T>& stress, double sign,
                    std::span<Vec3> nodal) noexcept {
    Block<T> h = product_transposed(stress, shape.inverse);
    const T factor = sign * shape.volume;
    for (int i = 0; i < 9; ++i) h.m[i] *= factor;
    T opposite[3];
    for (int i = 0; i < 3; ++i) opposite[i] = -(h.m[3 * i] + h.m[3 * i + 1] + h.m[3 * i + 2]);
    for (int lane = 0; lane < LaneTraits<T>::kCount; ++lane) {
        const Tet& t = model.tet_nodes[first + static_cast<std::size_t>(lane)];
        double* f[4] = {nodal[t[0]].data(), nodal[t[1]].data(), nodal[t[2]].data(), nodal[t[3]].data()};
        for (int i = 0; i < 3; ++i) {
            f[0][i] += get_lane(opposite[i], lane);
            for (int k = 0; k < 3; ++k) f[k + 1][i] += get_lane(h.m[3 * i + k], lane);
        }
    }
}

template <class T> inline T determinant(const Block<T>& f, const Block<T>& cof) noexcept {
    return f.m[0] * cof.m[0] + f.m[1] * cof.m[1] + f.m[2] * cof.m[2];
}

inline void note_volume(TetReport& report, double det, std::size_t tet) noexcept {
    if (det < report.min_volume_ratio || report.min_volume_tet == kNoIndex) {
        report.min_volume_ratio = det;
        report.min_volume_tet = static_cast<Index>(tet);
    }
    if (det <= 0.0) ++report.inverted;
}

/// Calls body.template operator()<T>(first) for pairs of tets, then for the odd one.
template <class Body> inline void for_each_tet(std::size_t count, Body&& body) noexcept {
    std::size_t tet = 0;
    for (; tet + 2 <= count; tet += 2) body.template operator()<Pair>(tet);
    if (tet < count) body.template operator()<double>(tet);
}

template <class Law, bool kViscous>
void add_forces(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> velocity,
                std::span<Vec3> force, TetReport& report) noexcept {
    for_each_tet(model.tet_count(), [&]<class T>(std::size_t first) {
        const Shape<T> shape = load_shape<T>(model, first);
        const Block<T> f = find_gradient(model, first, shape, position);
        const Block<T> cof = cofactors(f);
        const T det = determinant(f, cof);
        Block<T> stress = Law::stress(model.law, f, cof, det);
        if constexpr (kViscous) {
            const Block<T> drag =
                viscous_stress(model.material.viscosity, f, find_gradient(model, first, shape, velocity));
            for (int i = 0; i < 9; ++i) stress.m[i] += drag.m[i];
        }
        scatter(model, first, shape, stress, -1.0, force);
        const T stiffness = Law::tangent_scale(model.law, f, cof, det) * contraction(shape.inverse, shape.inverse);
        for (int lane = 0; lane < LaneTraits<T>::kCount; ++lane) {
            note_volume(report, get_lane(det, lane), first + static_cast<std::size_t>(lane));
            if (get_lane(stiffness, lane) > report.stiffest) report.stiffest = get_lane(stiffness, lane);
        }
    });
}

template <class Law> TetReport measure(const TissueModel& model, std::span<const Vec3> position) noexcept {
    TetReport report;
    for (std::size_t tet = 0; tet < model.tet_count(); ++tet) {
        const Shape<double> shape = load_shape<double>(model, tet);
        const Block<double> f = find_gradient(model, tet, shape, position);
        const double det = determinant(f, cofactors(f));
        const double energy = shape.volume * Law::energy(model.law, f, det);
        note_volume(report, det, tet);
        report.elastic_energy += energy;
        if (!(std::isfinite(det) && std::isfinite(energy)) && report.first_bad_tet == kNoIndex)
            report.first_bad_tet = static_cast<Index>(tet);
    }
    return report;
}

template <class Law>
Index add_stiffness(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> displacement,
                    std::span<Vec3> out) noexcept {
    Index worst = kNoIndex;
    double most = 0.0;
    for_each_tet(model.tet_count(), [&]<class T>(std::size_t first) {
        const Shape<T> shape = load_shape<T>(model, first);
        const Block<T> f = find_gradient(model, first, shape, position);
        const Block<T> d = find_gradient(model, first, shape, displacement);
        const Block<T> cof = cofactors(f);
        const Block<T> stress = Law::stress_along(model.law, f, cof, determinant(f, cof), d);
        scatter(model, first, shape, stress, 1.0, out);
        const T taken = shape.volume * contraction(d, stress);
        for (int lane = 0; lane < LaneTraits<T>::kCount; ++lane)
            if (get_lane(taken, lane) > most) {
                most = get_lane(taken, lane);
                worst = static_cast<Index>(first) + static_cast<Index>(lane);
            }
    });
    return worst;
}

/// Calls body.template operator()<Law>().
template <class Body> auto with_law(MaterialLaw law, Body&& body) noexcept {
    switch (law) {
    case MaterialLaw::StVK: return body.template operator()<StVKLaw>();
    case MaterialLaw::Corotational: return body.template operator()<CorotationalLaw>();
    case MaterialLaw::NeoHookean: break;
    }
    return body.template operator()<NeoHookeanLaw>();
}

} // namespace

TetReport add_tet_forces(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> velocity,
                         std::span<Vec3> force) noexcept {
    TetReport report;
    with_law(model.material.law, [&]<class Law>() {
        if (model.material.viscosity > 0.0) add_forces<Law, true>(model, position, velocity, force, report);
        else add_forces<Law, false>(model, position, velocity, force, report);
    });
    return report;
}

TetReport measure_tets(const TissueModel& model, std::span<const Vec3> position) noexcept {
    return with_law(model.material.law, [&]<class Law>() { return measure<Law>(model, position); });
}

Index add_stiffness_product(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> displacement,
                            std::span<Vec3> product) noexcept {
    return with_law(model.material.law,
                    [&]<class Law>() { return add_stiffness<Law>(model, position, displacement, product); });
}

void add_damping_product(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> velocity,
                         std::span<Vec3> product) noexcept {
    if (!(model.material.viscosity > 0.0)) return;
    for_each_tet(model.tet_count(), [&]<class T>(std::size_t first) {
        const Shape<T> shape = load_shape<T>(model, first);
        const Block<T> f = find_gradient(model, first, shape, position);
        const Block<T> rate = find_gradient(model, first, shape, velocity);
        scatter(model, first, shape, viscous_stress(model.material.viscosity, f, rate), 1.0, product);
    });
}

} // namespace seldinger::fem
