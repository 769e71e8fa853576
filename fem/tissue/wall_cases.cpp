#include "fem/tissue/wall_cases.hpp"

#include "fem/mesh/mapped_mesh.hpp"
#include "fem/mesh/wall_mesh.hpp"
#include "fem/tissue/case_bodies.hpp"
#include "fem/tissue/forces.hpp"
#include "fem/tissue/relaxation.hpp"
#include "fem/tissue/statics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace trocar::fem {

namespace {

TissueModel make_wall_body(const WallMesh& wall, Index layers, double poisson_ratio, TetElements elements, const std::vector<Index>& pinned = {}) {
    return make_body(wall.tets, 1.0, poisson_ratio, elements, pinned, 1000.0, static_cast<Index>(wall.tets.vertices.size() / (layers + 1)));
}

/// Along z, open at both ends.
TriMesh make_pipe(double radius, double length, Index around, Index rings) {
    TriMesh pipe;
    for (Index i = 0; i < rings; ++i)
        for (Index j = 0; j < around; ++j)
            pipe.vertices.push_back(Vec3(radius * std::cos(2.0 * std::numbers::pi * j / around), radius * std::sin(2.0 * std::numbers::pi * j / around), length * i / (rings - 1)));
    const auto id = [around](Index i, Index j) { return i * around + j % around; };
    for (Index i = 0; i + 1 < rings; ++i)
        for (Index j = 0; j < around; ++j) {
            pipe.triangles.push_back({id(i, j), id(i, j + 1), id(i + 1, j + 1)});
            pipe.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i + 1, j)});
        }
    return pipe;
}

} // namespace

double shell_ratio(Index around, Index layers, double poisson_ratio, TetElements elements) {
    const TriMesh sphere = make_octasphere(around / 4);
    const Result<WallMesh> wall = make_wall_mesh(sphere, {.thickness = 0.1, .layers = layers});
    const TissueModel model = make_wall_body(*wall, layers, poisson_ratio, elements);
    const Field u = solve_small_strain(model, press_out(wall->tets, sphere));
    double widened = 0.0;
    for (std::size_t v = 0; v < sphere.vertices.size(); ++v) widened += u[v].dot(sphere.vertices[v]) / static_cast<double>(sphere.vertices.size());
    const double b3 = 1.1 * 1.1 * 1.1;
    return widened / (((1.0 - 2.0 * poisson_ratio) + (1.0 + poisson_ratio) * 0.5 * b3) / (b3 - 1.0));
}

double crushed_ring_ratio(Index around, Index layers, double poisson_ratio, TetElements elements) {
    constexpr double kThick = 0.1, kMiddle = 1.0;
    constexpr Index kRings = 3;
    const double width = 2.0 * std::numbers::pi / around * (kRings - 1);
    const TriMesh pipe = make_pipe(kMiddle - 0.5 * kThick, width, around, kRings);
    const auto id = [around](Index i, Index j) { return i * around + j % around; };
    const Result<WallMesh> wall = make_wall_mesh(pipe, {.thickness = kThick, .layers = layers});
    const TissueModel model = make_wall_body(*wall, layers, poisson_ratio, elements);
    Field force(wall->tets.vertices.size(), Vec3::Zero());
    const Index across = around / 2;
    const auto count = static_cast<Index>(pipe.vertices.size());
    for (Index i = 0; i < kRings; ++i) { // shared by all nodes through the thickness at two opposite places
        const double share = (i == 0 || i + 1 == kRings ? 0.5 : 1.0) / (kRings - 1) / (layers + 1);
        for (Index layer = 0; layer <= layers; ++layer) force[layer * count + id(i, 0)].x() -= share, force[layer * count + id(i, across)].x() += share;
    }
    const Field u = solve_small_strain(model, force);
    double shorter = 0.0; // of the middle of the thickness
    for (Index i = 0; i < kRings; ++i)
        for (const Index layer : {0u, layers})
            shorter += (u[layer * count + id(i, across)].x() - u[layer * count + id(i, 0)].x()) / (2.0 * kRings);
    return shorter / ((0.25 * std::numbers::pi - 2.0 / std::numbers::pi) * 12.0 / (width * kThick * kThick * kThick));
}

namespace {

constexpr double kPlateNu = 0.3;

/// Square, of side 1, clamped all around, modulus 1.
struct Plate {
    TriMesh sheet;
    TissueModel model;
    Field way; // under a pressure of 1
};

Plate press_plate(Index cells, double thickness, double uneven, TetElements elements) {
    std::mt19937_64 engine(7);
    const auto random = [&] { return std::ldexp(static_cast<double>(engine() >> 11), -53); };
    TriMesh sheet;
    const double cell = 1.0 / cells;
    for (Index i = 0; i <= cells; ++i)
        for (Index j = 0; j <= cells; ++j) {
            const bool held = i == 0 || j == 0 || i == cells || j == cells;
            const double aside = 2.0 * uneven * random() - uneven, ahead = 2.0 * uneven * random() - uneven;
            sheet.vertices.push_back(cell * (Vec3(i, j, 0.0) + (held ? 0.0 : 1.0) * Vec3(aside, ahead, 0.0)));
        }
    for (Index i = 0; i < cells; ++i)
        for (Index j = 0; j < cells; ++j) {
            const Index a = i * (cells + 1) + j, b = a + cells + 1, c = b + 1, d = a + 1;
            const bool turned = uneven > 0.0 && random() < 0.5;
            sheet.triangles.push_back(turned ? Triangle{a, b, d} : Triangle{a, b, c});
            sheet.triangles.push_back(turned ? Triangle{b, c, d} : Triangle{a, c, d});
        }
    const Result<WallMesh> wall = make_wall_mesh(sheet, {.thickness = thickness, .layers = 1});
    std::vector<Index> pinned;
    for (const int axis : {0, 1})
        for (const double end : {0.0, 1.0})
            for (const Index node : nodes_across(wall->tets, axis, end)) pinned.push_back(node);
    std::sort(pinned.begin(), pinned.end());
    pinned.erase(std::unique(pinned.begin(), pinned.end()), pinned.end());
    TissueModel model = make_wall_body(*wall, 1, kPlateNu, elements, pinned);
    Field way = solve_small_strain(model, press_out(wall->tets, sheet));
    return {std::move(sheet), std::move(model), std::move(way)};
}

} // namespace

double pressed_plate_ratio(Index cells, double thickness, double uneven, TetElements elements) {
    constexpr double kDeflection = 0.00126532;
    const Plate plate = press_plate(cells, thickness, uneven, elements);
    double nearest = 1.0, way = 0.0;
    for (std::size_t v = 0; v < plate.sheet.vertices.size(); ++v)
        if (const double off = (plate.sheet.vertices[v] - Vec3(0.5, 0.5, 0.0)).norm(); off < nearest) nearest = off, way = plate.way[v].z();
    return way / (kDeflection * 12.0 * (1.0 - kPlateNu * kPlateNu) / (thickness * thickness * thickness));
}

double pressed_plate_damping(Index cells, double thickness, double uneven) {
    Plate plate = press_plate(cells, thickness, uneven, TetElements::Prisms);
    plate.model.material.viscosity = 0.5 / (1.0 + kPlateNu); // mu
    const Field& rest = plate.model.rest_position;
    Field stiff(rest.size(), Vec3::Zero()), damped = stiff;
    add_stiffness_product(plate.model, rest, plate.way, stiff);
    add_damping_product(plate.model, rest, plate.way, damped);
    double over = 0.0, under = 0.0;
    for (std::size_t n = 0; n < rest.size(); ++n) over += damped[n].dot(plate.way[n]), under += stiff[n].dot(plate.way[n]);
    return over / under;
}

double pressed_plate_relaxation(Index cells, double thickness, double uneven) {
    Plate plate = press_plate(cells, thickness, uneven, TetElements::Prisms);
    TissueModel& model = plate.model;
    model.material.g1 = model.material.tau1 = 1.0;
    const Field& rest = model.rest_position;
    Field stiff(rest.size(), Vec3::Zero()), moved = rest;
    add_stiffness_product(model, rest, plate.way, stiff);
    double far = 0.0, over = 0.0, under = 0.0;
    for (const Vec3& way : plate.way) far = std::max(far, way.norm());
    const double small = 1e-4 * thickness / far;
    for (std::size_t n = 0; n < rest.size(); ++n) moved[n] += small * plate.way[n];
    std::vector<NodeRecord> records(model.node_count());
    std::vector<PartialForce> partial(model.plan.slots.size(), PartialForce{});
    gather_records(model.plan, moved, moved, records);
    add_relaxation_forces(model, records, std::vector<double>(relaxation_size(model)), partial, 1);
    for (std::size_t record = 0; record < records.size(); ++record) {
        const Index node = model.plan.node_of[record];
        over -= sum_partial(model.plan, partial, record).dot(plate.way[node]) / small;
        under += stiff[node].dot(plate.way[node]);
    }
    return over / under;
}

double pressed_tube_way(Index around, Index layers, double poisson_ratio, TetElements elements) {
    constexpr double kThick = 0.2, kLong = 6.0, kWide = 0.3; // of a bore of 1
    const auto rings = static_cast<Index>(std::lround(kLong / (2.0 * std::numbers::pi / around))) / 2 * 2 + 1;
    const TriMesh pipe = make_pipe(1.0, kLong, around, rings);
    const Result<WallMesh> wall = make_wall_mesh(pipe, {.thickness = kThick, .layers = layers});
    std::vector<Index> pinned = nodes_across(wall->tets, 2, 0.0);
    for (const Index node : nodes_across(wall->tets, 2, kLong)) pinned.push_back(node);
    const TissueModel model = make_wall_body(*wall, layers, poisson_ratio, elements, pinned);
    Field force(wall->tets.vertices.size(), Vec3::Zero());
    std::vector<double> share(pipe.vertices.size());
    double sum = 0.0;
    for (std::size_t v = 0; v < share.size(); ++v) sum += share[v] = std::exp(-(pipe.vertices[v] - Vec3(1.0, 0.0, 0.5 * kLong)).squaredNorm() / (kWide * kWide));
    for (std::size_t v = 0; v < share.size(); ++v) force[v].x() = share[v] / sum;
    const Field u = solve_small_strain(model, force);
    double way = 0.0;
    for (std::size_t v = 0; v < share.size(); ++v) way += share[v] / sum * u[v].x();
    return way;
}

} // namespace trocar::fem
