// What the parts of the scene reader share. Each reads a checked object into its struct and finds the mistakes that a
// table cannot: names that point nowhere, values that contradict each other.
#pragma once

#include "engine/scene/check.hpp"
#include "engine/scene/scene.hpp"
#include "engine/scene/values.hpp"

#include <optional>
#include <string>

namespace trocar::engine {

/// [-] a path or a speed that keeps a limit exactly, as written in decimals, must not fail by rounding.
inline constexpr double kLimitTolerance = 1e-9;

/// What a reading function is given besides the members to fill. Of the scene everything before its object has been read.
struct Reading {
    const CheckContext& context;
    const Values& values;
    const Scene& scene;
};

/// The file of a key that passed the check.
[[nodiscard]] std::filesystem::path checked_file(const CheckContext& context, const std::string& name);

/// An error about the value of a key that is there; about the object's place where it is absent.
[[nodiscard]] Error fail_at(const CheckContext& context, const Values& values, std::string_view key, std::string message,
                            ErrorCode code = ErrorCode::BadValue);

/// A direction of any length but zero, made a unit vector.
[[nodiscard]] std::optional<Error> read_direction(const CheckContext& context, const Values& values, std::string_view key, Vec3& direction);

/// Reading functions of keys whose values are more than one number or word (custom_key): called whether the key is there or not.
[[nodiscard]] std::optional<Error> read_substeps(const Reading& reading, unsigned& substeps);
[[nodiscard]] std::optional<Error> read_limit(const Reading& reading, BudgetLimits& limits);
[[nodiscard]] std::optional<Error> read_drop(const Reading& reading, std::vector<Droppable>& drop);
[[nodiscard]] std::optional<Error> read_pictures(const Reading& reading, std::vector<PictureSpec>& pictures);
[[nodiscard]] std::optional<Error> read_picture_size(const Reading& reading, unsigned& width, unsigned& height);
[[nodiscard]] std::optional<Error> read_primary(const Reading& reading, double& angle);
[[nodiscard]] std::optional<Error> read_secondary(const Reading& reading, double& angle);
[[nodiscard]] std::optional<Error> read_arm(const Reading& reading, std::vector<ArmRow>& arm);
[[nodiscard]] std::optional<Error> read_detector(const Reading& reading, std::array<double, 2>& detector);
[[nodiscard]] std::optional<Error> read_xray_pixels(const Reading& reading, std::array<unsigned, 2>& pixels);
[[nodiscard]] std::optional<Error> read_window(const Reading& reading, std::optional<std::array<double, 2>>& window);
[[nodiscard]] std::optional<Error> read_bits(const Reading& reading, unsigned& bits);
[[nodiscard]] std::optional<Error> read_matter(const Reading& reading, std::vector<std::pair<std::string, XrayMatter>>& matter);
[[nodiscard]] std::optional<Error> read_views(const Reading& reading, std::vector<XrayView>& views);
[[nodiscard]] std::optional<Error> read_inlet(const Reading& reading, std::optional<SceneTarget>& inlet);
[[nodiscard]] std::optional<Error> read_file_unit(const Reading& reading, double& unit);
[[nodiscard]] std::optional<Error> read_groups(const Reading& reading, std::vector<std::string>& groups);
[[nodiscard]] std::optional<Error> read_repairs(const Reading& reading, std::vector<Repair>& repairs);
[[nodiscard]] std::optional<Error> read_surface_spec(const Reading& reading, SurfaceSpec& surface);
[[nodiscard]] std::optional<Error> read_coarse(const Reading& reading, CoarseSpec& coarse);
[[nodiscard]] std::optional<Error> read_regions(const Reading& reading, std::vector<TissueRegion>& regions);
[[nodiscard]] std::optional<Error> read_box(const Reading& reading, Box3& box);
[[nodiscard]] std::optional<Error> read_node_list(const Reading& reading, std::filesystem::path& file, std::vector<Index>& nodes);
[[nodiscard]] std::optional<Error> read_fixed(const Reading& reading, std::vector<HeldRegion>& fixed);
[[nodiscard]] std::optional<Error> read_region(const Reading& reading, const JsonNode& node, FixedRegion& region);
[[nodiscard]] std::optional<Error> read_loads(const Reading& reading, std::vector<LoadSpec>& loads);
[[nodiscard]] std::optional<Error> read_where(const Reading& reading, std::optional<FixedRegion>& region);
[[nodiscard]] std::optional<Error> read_over(const Reading& reading, std::vector<LoadRow>& rows);
[[nodiscard]] std::optional<Error> read_rotation(const Reading& reading, std::vector<LoadRow>& rows);
[[nodiscard]] std::optional<Error> read_turns(const Reading& reading, std::vector<LoadRow>& rows);
[[nodiscard]] std::optional<Error> read_moves(const Reading& reading, std::vector<KeyFrame>& moves);
/// Rows of a time and a displacement under any key.
[[nodiscard]] std::optional<Error> read_frames(const Reading& reading, std::string_view key, std::vector<KeyFrame>& frames);
[[nodiscard]] std::optional<Error> read_motion(const Reading& reading, std::vector<KeyFrame>& motion);
[[nodiscard]] std::optional<Error> read_stiffness(const Reading& reading, std::vector<fem::ProfileRow>& stiffness);
[[nodiscard]] std::optional<Error> read_coating(const Reading& reading, std::vector<fem::ProfileRow>& coating);
[[nodiscard]] std::optional<Error> read_layers(const Reading& reading, std::vector<TubeLayer>& layers);
[[nodiscard]] std::optional<Error> read_arcs(const Reading& reading, std::vector<fem::TipArc>& arcs);
[[nodiscard]] std::optional<Error> read_follow_target(const Reading& reading, Index& target);

[[nodiscard]] std::optional<Error> read_time(const Reading& reading, TimeSpec& time);

/// "budget" of the scene: a limit, or an object.
[[nodiscard]] std::optional<Error> read_budget(const Reading& scene, BudgetSpec& budget);

/// "effects" of the scene. Bodies and instruments have been read.
[[nodiscard]] std::optional<Error> read_effects(const Reading& scene, Effects& effects);

/// References to other bodies are left open: see resolve_host_body.
[[nodiscard]] std::optional<Error> read_body(const Reading& reading, SceneBody& body);

/// embedded_in, once all bodies are known.
[[nodiscard]] std::optional<Error> resolve_host_body(const CheckContext& context, const Values& values, const Scene& scene,
                                                     SceneBody& body);

/// The bodies that a free space lies around, likewise.
[[nodiscard]] std::optional<Error> resolve_around(const CheckContext& context, const Values& values, const Scene& scene, std::size_t body,
                                                  SurfaceSpec& surface);

/// Bodies have been read.
[[nodiscard]] std::optional<Error> read_target(const Reading& reading, SceneTarget& target);

/// Bodies and targets have been read.
[[nodiscard]] std::optional<Error> read_instrument(const Reading& reading, SceneInstrument& instrument);

/// The instrument's key path; its name, length and limits are known.
[[nodiscard]] std::optional<Error> read_path(const CheckContext& context, const Values& values, SceneInstrument& instrument);

/// Instruments have been read, with the files that move them.
[[nodiscard]] std::optional<Error> check_path_files(const Scene& scene);

} // namespace trocar::engine
