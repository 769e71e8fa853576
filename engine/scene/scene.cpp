#include "engine/scene/scene.hpp"

#include "base/repair.hpp"
#include "engine/scene/check.hpp"
#include "fem/tissue/tangent.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace trocar::engine {
namespace {

/// Rounding of duration / step must not add a step.
constexpr double kStepTolerance = 1e-9; // [-]

const char* kind_text(BodyKind kind) {
    switch (kind) {
    case BodyKind::Deformable:
        return "deformable";
    case BodyKind::Static:
        return "static";
    case BodyKind::Kinematic:
        return "kinematic";
    }
    return "";
}

std::string surface_text(const SurfaceSpec& surface) {
    if (surface.source == SurfaceSource::Recipe) return fmt::format("{} of recipe {}", surface.part, surface.file.string());
    if (surface.source == SurfaceSource::Shape) {
        constexpr const char* kNames[] = {"sphere", "box", "tube", "torus", "vessels"};
        return kNames[static_cast<std::size_t>(surface.shape.kind)];
    }
    std::string text = surface.file.string();
    if (!surface.groups.empty()) text += fmt::format(", {} groups", surface.groups.size());
    std::vector<std::string_view> repairs;
    for (const Repair repair : surface.repair) repairs.push_back(repair_name(repair));
    if (!repairs.empty()) text += fmt::format(", repairs: {}", fmt::join(repairs, ", "));
    return text;
}

/// What the constants of a law come to; nothing of the plain ones, which are given by their moduli.
std::string material_text(const Scene& scene, const SceneBody& body) {
    const fem::Material& m = body.material;
    const auto unit = [&](double si) { return with_unit(si, Dimension::Pressure, scene.units); };
    std::string text;
    if (m.law >= fem::MaterialLaw::MooneyRivlin) {
        const fem::SmallStrain small = fem::find_small_strain(m);
        constexpr const char* kNames[] = {"Mooney-Rivlin", "Ogden", "Holzapfel-Gasser-Ogden"};
        text += fmt::format("  {}{}: shear modulus {}, bulk modulus {} at small strain{}; pulled{}, its tangent is {} at a stretch of 0.8, "
                            "{} at 1, {} at 1.2\n",
                            kNames[static_cast<int>(m.law) - static_cast<int>(fem::MaterialLaw::MooneyRivlin)],
                            body.preset.empty() ? "" : fmt::format(" ({})", body.preset), unit(small.mu), unit(small.bulk_modulus()),
                            m.law == fem::MaterialLaw::Hgo ? " without fibres" : "",
                            m.law == fem::MaterialLaw::Hgo ? " along the first fibres" : "", unit(fem::find_pull_tangent(m, 0.8)),
                            unit(fem::find_pull_tangent(m, 1.0)), unit(fem::find_pull_tangent(m, 1.2)));
    }
    if (m.g1 + m.g2 + m.g3 > 0.0)
        text += fmt::format("  stress relaxes: the shear modulus at once is {:.4g} times that in the end\n", 1.0 + m.g1 + m.g2 + m.g3);
    return text;
}

std::string body_text(const Scene& scene, const SceneBody& body) {
    std::string text =
        fmt::format("body {}: {}{}, {}\n", body.name, kind_text(body.kind), body.hollow ? ", hollow" : "", surface_text(body.surface));
    if (body.embedded_in != kNoIndex) text += fmt::format("  carried by {}\n", scene.bodies[body.embedded_in].name);
    if (body.kind != BodyKind::Deformable) return text;
    const auto unit = [&](double si, Dimension dimension) { return with_unit(si, dimension, scene.units); };
    text += fmt::format("  Young's modulus {}, Poisson's ratio {:.4g}, density {}, {} fixed regions\n",
                        unit(fem::find_small_strain(body.material).young_modulus(), Dimension::Pressure), body.material.poisson_ratio,
                        unit(body.material.density, Dimension::Density), body.fixed.size());
    return text + material_text(scene, body);
}

std::string script_text(const Scene& scene, const SceneInstrument& instrument) {
    if (!instrument.path.empty())
        return fmt::format("a path of {} rows until {}", instrument.path.size(),
                           with_unit(instrument.path.back().time, Dimension::Time, scene.units));
    if (!instrument.follow) return "nothing: it stays where it is";
    return fmt::format("the script, to {} at up to {}", scene.targets[instrument.follow->target].name,
                       with_unit(instrument.follow->settings.speed, Dimension::Speed, scene.units));
}

std::string instrument_text(const Scene& scene, const SceneInstrument& instrument) {
    const auto unit = [&](double si, Dimension dimension) { return with_unit(si, dimension, scene.units); };
    constexpr const char* kTips[] = {"straight", "J", "Simmons", "pigtail"};
    const fem::RodDesign& design = instrument.design;
    const std::string place =
        instrument.inside == kNoIndex ? scene.bodies[instrument.lumen].name : scene.instruments[instrument.inside].name;
    return fmt::format("instrument {}: in {}, length {}, radius {}, Young's modulus {}, {} tip, friction {:.3g}\n  moved by {}\n",
                       instrument.name, place, unit(design.length, Dimension::Length), unit(design.radius, Dimension::Length),
                       unit(design.young_modulus, Dimension::Pressure), kTips[static_cast<std::size_t>(design.tip)], instrument.friction,
                       script_text(scene, instrument));
}

} // namespace

std::size_t TimeSpec::step_count() const noexcept { return static_cast<std::size_t>(std::ceil(duration / step * (1.0 - kStepTolerance))); }

Error scene_error(const Scene& scene, std::string key, std::string message, ErrorCode code) {
    Error error{code, std::move(message), scene.file.string(), 0, 0, std::move(key)};
    for (std::string path = error.key;;) {
        const auto found = scene.positions.find(path);
        if (found != scene.positions.end()) {
            error.line = found->second.line;
            error.column = found->second.column;
            return error;
        }
        if (path.empty()) return error;
        const std::size_t cut = path.find_last_of(".[");
        path.resize(cut == std::string::npos ? 0 : cut);
    }
}

Index find_body(const Scene& scene, std::string_view name) noexcept {
    for (Index i = 0; i < scene.bodies.size(); ++i)
        if (scene.bodies[i].name == name) return i;
    return kNoIndex;
}

Index find_target(const Scene& scene, std::string_view name) noexcept {
    for (Index i = 0; i < scene.targets.size(); ++i)
        if (scene.targets[i].name == name) return i;
    return kNoIndex;
}

std::string to_text(const Scene& scene) {
    const auto unit = [&](double si, Dimension dimension) { return with_unit(si, dimension, scene.units); };
    std::string text = fmt::format("{} ({})\n", scene.name, scene.file.string());
    text += fmt::format("{} steps of {}, {} in all; budget {} for {}\n", scene.time.step_count(), unit(scene.time.step, Dimension::Time),
                        unit(scene.time.duration, Dimension::Time), scene.budget.to_string(),
                        scene.budget.scope == BudgetScope::Step ? "the whole step" : "contact");
    text += fmt::format("effects: {}\n", fmt::join(scene.effects.names(), ", "));
    if (scene.effects.gravity) text += fmt::format("gravity {}\n", unit(scene.gravity.norm(), Dimension::Acceleration));
    for (const SceneBody& body : scene.bodies) text += body_text(scene, body);
    for (const SceneInstrument& instrument : scene.instruments) text += instrument_text(scene, instrument);
    for (const SceneTarget& target : scene.targets)
        text +=
            fmt::format("target {}: {}\n", target.name, target.place.landmark.empty() ? "a position" : "landmark " + target.place.landmark);
    for (const std::string& question : scene.questions) text += fmt::format("note: {}\n", question);
    return text;
}

} // namespace trocar::engine
