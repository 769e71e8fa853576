#include "fem/tissue/law_validation.hpp"

#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/forces.hpp"
#include "fem/tissue/relaxation.hpp"
#include "fem/tissue/tissue.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trocar::fem {

namespace {

constexpr double kYoung = 5000.0; // Pa
constexpr double kFibreAngle = 0.5; // rad, of both families from the first direction

Material make_material(MaterialLaw law, double poisson_ratio) {
    Material m{.law = law, .young_modulus = kYoung, .poisson_ratio = poisson_ratio, .density = 1000.0};
    const double mu = kYoung / (2.0 * (1.0 + poisson_ratio));
    m.c10 = 0.35 * mu, m.c01 = 0.15 * mu;
    m.alpha1 = 4.0, m.mu1 = 0.6 * 2.0 * mu / 4.0;
    m.alpha2 = -3.0, m.mu2 = -0.3 * 2.0 * mu / 3.0;
    m.alpha3 = 1.5, m.mu3 = 0.1 * 2.0 * mu / 1.5;
    m.k1 = 2000.0, m.k2 = 0.5;
    m.fibre1 = Vec3(std::cos(kFibreAngle), std::sin(kFibreAngle), 0.0);
    m.fibre2 = Vec3(std::cos(kFibreAngle), -std::sin(kFibreAngle), 0.0);
    return m;
}

TissueModel make_block(const Material& material, TetElements elements) {
    Material m = material;
    m.elements = elements;
    return make_tissue_model(make_bar_mesh({2, 2, 2}, 0.5, 0.0), m, {}).value();
}

/// Mean first Piola-Kirchhoff stress of a cube of 1 m in a uniform deformation.
Mat3 stress_of_block(const TissueModel& model, const Mat3& f) {
    std::vector<Vec3> position, force(model.node_count(), Vec3::Zero());
    for (const Vec3& x : model.rest_position) position.push_back(f * x);
    const std::vector<Vec3> still(model.node_count(), Vec3::Zero());
    (void)add_tet_forces(model, position, still, force);
    Mat3 stress = Mat3::Zero();
    for (std::size_t node = 0; node < force.size(); ++node) stress -= force[node] * model.rest_position[node].transpose();
    return stress;
}

double fibre_stress(const Material& m, const double l[3], int i) {
    const double size = l[0] * l[0] + l[1] * l[1] + l[2] * l[2], cosine = m.fibre1.x(), sine = m.fibre1.y();
    const double along = l[0] * l[0] * cosine * cosine + l[1] * l[1] * sine * sine;
    const double strain = std::max(0.0, m.kappa * (size - 3.0) + (1.0 - 3.0 * m.kappa) * (along - 1.0));
    const double part = m.kappa + (1.0 - 3.0 * m.kappa) * (i == 0 ? cosine * cosine : i == 1 ? sine * sine : 0.0);
    return 2.0 * m.k1 * strain * std::exp(m.k2 * strain * strain) * 2.0 * l[i] * part;
}

/// The third stretch of a plate without stress across: by bisection between where it pulls inwards and outwards.
double find_thickness(const Material& material, double l1, double l2) {
    double low = 1e-3, high = 20.0;
    for (int round = 0; round < 200; ++round) {
        const double middle = 0.5 * (low + high), l[3] = {l1, l2, middle};
        (principal_stress(material, l, 2) < 0.0 ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

/// A block in simple shear with branches that relax: its stress is linear in a small shear.
class ShearedBlock {
public:
    ShearedBlock(const Material& material, TetElements elements) : model_(make_block(material, elements)), records_(model_.node_count()) {
        state_ = make_rest_state(model_);
        state_.relaxed.resize(relaxation_size(model_));
    }
    /// Pa, as it stands in its branches now
    double stress(double shear) {
        place(shear);
        std::vector<PartialForce> partial(model_.plan.slots.size());
        (void)run_tets(model_.plan, make_tet_job(model_, TetKernel::Force, 1), records_, partial);
        add_relaxation_forces(model_, records_, state_.relaxed, partial, 1);
        double sum = 0.0;
        for (std::size_t record = 0; record < records_.size(); ++record)
            sum -= sum_partial(model_.plan, partial, record)[0] * model_.rest_position[model_.plan.node_of[record]][1];
        return sum;
    }
    void wait(double shear, double seconds) {
        place(shear);
        relax(model_, records_, seconds, state_.relaxed, 1);
    }

private:
    void place(double shear) {
        std::vector<Vec3> sheared;
        for (const Vec3& x : model_.rest_position) sheared.push_back(x + Vec3(shear * x[1], 0, 0));
        gather_records(model_.plan, sheared, sheared, records_);
    }

    TissueModel model_;
    TissueState state_;
    std::vector<NodeRecord> records_;
};

constexpr double kShear = 1e-5; // [-]

} // namespace

std::vector<NamedMaterial> biaxial_materials() {
    std::vector<NamedMaterial> all;
    constexpr double kPoisson = 0.47;
    all.push_back({"stvk", make_material(MaterialLaw::StVK, 0.3)});
    all.push_back({"corotational", make_material(MaterialLaw::Corotational, 0.3)});
    all.push_back({"neo_hookean", make_material(MaterialLaw::NeoHookean, kPoisson)});
    all.push_back({"mooney_rivlin", make_material(MaterialLaw::MooneyRivlin, kPoisson)});
    for (int terms = 1; terms <= 3; ++terms) {
        Material m = make_material(MaterialLaw::Ogden, kPoisson);
        if (terms < 3) m.mu3 = m.alpha3 = 0.0;
        if (terms < 2) m.mu2 = m.alpha2 = 0.0;
        all.push_back({"ogden, " + std::to_string(terms) + (terms > 1 ? " terms" : " term"), m});
    }
    for (const double kappa : {0.0, 0.2}) {
        Material m = make_material(MaterialLaw::Hgo, kPoisson);
        m.kappa = kappa;
        all.push_back({kappa > 0.0 ? "hgo, dispersed" : "hgo", m});
    }
    return all;
}

double principal_stress(const Material& m, const double l[3], int i) {
    const LawConstants c = make_law_constants(m);
    const double volume = l[0] * l[1] * l[2], size = l[0] * l[0] + l[1] * l[1] + l[2] * l[2];
    const double push = c.lambda * (volume - c.rest_volume) * volume / l[i];
    switch (m.law) {
    case MaterialLaw::StVK:
        return l[i] * (c.mu * (l[i] * l[i] - 1.0) + 0.5 * c.lambda * (size - 3.0));
    case MaterialLaw::Corotational:
        return 2.0 * c.mu * (l[i] - 1.0) + c.lambda * (l[0] + l[1] + l[2] - 3.0);
    case MaterialLaw::NeoHookean:
        return c.mu * l[i] * (1.0 - 1.0 / (size + 1.0)) + push;
    case MaterialLaw::MooneyRivlin:
        return 2.0 * m.c10 * l[i] + 2.0 * m.c01 * l[i] * (size - l[i] * l[i]) + push;
    case MaterialLaw::Ogden: {
        double sum = push;
        const double mu[] = {m.mu1, m.mu2, m.mu3}, alpha[] = {m.alpha1, m.alpha2, m.alpha3};
        for (int k = 0; k < 3; ++k)
            if (alpha[k] != 0.0) sum += mu[k] * std::pow(l[i], alpha[k] - 1.0);
        return sum;
    }
    case MaterialLaw::Hgo:
        return c.mu * l[i] * (1.0 - 1.0 / (size + 1.0)) + push + fibre_stress(m, l, i);
    }
    return 0.0;
}

double biaxial_error(const Material& material, TetElements elements) {
    const TissueModel model = make_block(material, elements);
    const bool gives_way = material.law == MaterialLaw::StVK; // pressed hard it has no thickness without stress: held at 1
    double worst = 0.0;
    for (const auto& [l1, l2] : {std::pair{1.3, 1.3}, std::pair{1.5, 1.0}, std::pair{0.8, 1.1}, std::pair{0.6, 0.7}, std::pair{2.0, 1.4}}) {
        double l3 = 1.0;
        if (!gives_way) l3 = find_thickness(material, l1, l2);
        const double l[3] = {l1, l2, l3};
        const Mat3 p = stress_of_block(model, Vec3(l1, l2, l3).asDiagonal());
        const double scale = std::abs(principal_stress(material, l, 0)) + std::abs(principal_stress(material, l, 1));
        for (int i = 0; i < 3; ++i) worst = std::max(worst, std::abs(p(i, i) - principal_stress(material, l, i)) / scale);
    }
    return worst;
}

double relaxation_error(MaterialLaw law, TetElements elements, double step) {
    Material m = make_material(law, 0.45);
    m.k1 = 0.0;
    m.g1 = 1.5, m.tau1 = 0.2, m.g2 = 0.7, m.tau2 = 5.0;
    ShearedBlock block(m, elements);
    const double mu = find_small_strain(m).mu;
    const int steps = static_cast<int>(std::lround(10.0 / step)), every = std::max(1, steps / 50);
    double worst = 0.0;
    for (int k = 0; k <= steps; ++k) {
        const double time = k * step, wanted = mu * (1.0 + m.g1 * std::exp(-time / m.tau1) + m.g2 * std::exp(-time / m.tau2));
        if (k % every == 0) worst = std::max(worst, std::abs(block.stress(kShear) / kShear / wanted - 1.0));
        block.wait(kShear, step);
    }
    return worst;
}

double creep_error(TetElements elements, double step) {
    Material m = make_material(MaterialLaw::NeoHookean, 0.45);
    m.g1 = 1.0, m.tau1 = 0.3;
    ShearedBlock block(m, elements);
    const double mu = find_small_strain(m).mu, held = mu * kShear, at_once = mu * (1.0 + m.g1);
    double worst = 0.0, shear = 0.0;
    const int steps = static_cast<int>(std::lround(3.0 / step));
    for (int k = 0; k <= steps; ++k) {
        shear += (held - block.stress(shear)) / at_once; // linear: what the branches have not followed pulls as at once
        const double time = k * step, wanted = kShear * (1.0 - m.g1 / (1.0 + m.g1) * std::exp(-time / (m.tau1 * (1.0 + m.g1))));
        worst = std::max(worst, std::abs(shear / wanted - 1.0));
        block.wait(shear, step);
    }
    return worst;
}

} // namespace trocar::fem
