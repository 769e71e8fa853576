// A state as X-rays see it: which surfaces attenuate, and by how much.
//
// A body displaces what it lies in: a vessel that is embedded in an organ attenuates by blood minus that organ's matter, an instrument by
// its metal minus the blood, a wire by its metal minus its catheter's.
#pragma once

#include "engine/fluoroscopy/projector.hpp"
#include "engine/prepare/prepared_scene.hpp"
#include "engine/state/state.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

/// Of a state what a patient reads: surfaces, skins and rods, the nodes that carry the blood's centreline, what effects keep. All else is empty.
[[nodiscard]] State visible_part(const State& state);
/// Brings one up to date; what never moves stays. Allocates nothing after a first time.
/// to     visible_part of a state of the same model
void update_visible_part(const SceneModel& model, const State& from, State& to);

struct XrayBody {
    std::string name;
    XrayMatter matter = XrayMatter::Tissue;
    double attenuation = 0.0; // 1/m, beyond that of what it lies in
    double shell = 0.0;       // m; > 0: not closed
    double wall = 0.0; // 1/m, of a vessel's wall beyond what it lies in; 0: there is none to see
    bool moves = false, vessel = false;
};

class XrayPatient {
public:
    /// spec     its names and shell; both outlive the patient
    XrayPatient(const FluoroscopySpec& spec, const SceneModel& model);

    [[nodiscard]] const std::vector<XrayBody>& bodies() const noexcept { return bodies_; }           // as SceneModel::bodies
    [[nodiscard]] const std::vector<XrayBody>& instruments() const noexcept { return instruments_; } // as SceneModel::instruments

    [[nodiscard]] XraySurface body(const State& state, std::size_t index) const;
    /// A vessel's wall with its inside: the surface moved out along its normals by the wall's thickness, made anew by this call and valid until the
    /// next; empty where none is to see. To be drawn beside body, which is blood minus wall.
    [[nodiscard]] XraySurface wall(const State& state, std::size_t index);
    [[nodiscard]] XraySurface instrument(const State& state, std::size_t index) const;
    /// What contrast agent adds: closed pieces of vessel, made anew by this call and valid until the next; empty where there is none.
    [[nodiscard]] XraySurface contrast(const State& state);

    /// A sentence for each body that is taken as a thin shell.
    [[nodiscard]] std::vector<std::string> notices() const;

    /// The closed body that holds this place; nullptr: none.
    [[nodiscard]] const XrayBody* find_around(const State& state, const Vec3& place) const;
    /// At every stand of its arm the source is outside all of them.
    /// fails     BadValue
    [[nodiscard]] Result<void> check_source(const State& state, const XrayView& view) const;

    /// A C-arm that has everything in its picture, from the front.
    [[nodiscard]] static XrayView whole_view(const SceneModel& model, const State& state, std::array<unsigned, 2> pixels);

private:
    const SceneModel& model_;
    double wall_; // m
    std::vector<Vec3> wall_points_;
    std::vector<XrayBody> bodies_, instruments_;
    std::vector<Vec3> contrast_points_, flow_points_;
    std::vector<Triangle> contrast_triangles_;
    std::vector<double> contrast_attenuation_; // [triangles] 1/m
};

} // namespace trocar::engine
