// The same instant under several budgets, with the spheres that each took for contacts: figure 9 of Mendoza & O'Sullivan 2005.
#pragma once

#include "engine/render/renderer.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

struct CostPicture {
    std::string name; // of the row
    double time_s = 0.0;
    std::size_t tested = 0, assumed = 0; // pairs of spheres that count as contacts: tested to their leaves, and left open
    std::string png;                     // the file's bytes
};

/// Spheres that a simulator's last step took for contacts.
struct ContactSpheres {
    std::vector<spheretree::Sphere> tested, assumed; // each once
    std::size_t tested_pairs = 0, assumed_pairs = 0;
};
[[nodiscard]] ContactSpheres find_contact_spheres(const Simulator& simulator);

class CostPhotographer {
public:
    CostPhotographer(const PreparedScene& prepared, unsigned width, unsigned height);
    /// Bodies and instruments almost transparent, the spheres over them; every picture with the camera of the first.
    /// Without OpenGL no picture, and one notice.
    void take(const std::string& name, Simulator& simulator);
    [[nodiscard]] const std::vector<CostPicture>& pictures() const noexcept { return pictures_; }
    [[nodiscard]] const std::string& notice() const noexcept { return notice_; }

private:
    const PreparedScene& prepared_;
    unsigned width_, height_;
    std::unique_ptr<Renderer> renderer_;
    std::optional<Camera> camera_;
    std::vector<CostPicture> pictures_;
    std::string notice_;
};

} // namespace trocar::engine
