// The CPU reference of the image-space culler: the same footprints, the same two nearest per pixel and set, in plain C++.
#pragma once

#include "collision/culling/cull_backend.hpp"

#include <vector>

namespace trocar::collision {

class CpuCullBackend final : public CullBackend {
public:
    [[nodiscard]] std::string name() const override { return "CPU reference"; }
    [[nodiscard]] int preferred_resolution() const noexcept override { return 512; }
    void reserve(std::size_t prisms, std::size_t questions, int resolution) override;
    /// Never fails. One set after another in one picture, so memory does not grow with their number.
    /// cost   the pixels of all prisms drawn and queried; no allocation once the picture has grown
    [[nodiscard]] Result<void> find_hits(const CullJob& job, std::span<std::uint8_t> hits) override;

private:
    /// Half a cache line. A pixel's values from an earlier set are recognised by its `turn`, so nothing is ever cleared.
    struct Pixel {
        std::uint32_t turn = 0;
        Index first, second; // prisms
        float first_front, first_back, second_front, second_back, third_front;
    };
    void draw(const CullJob& job, Index prism);
    [[nodiscard]] bool is_hit(const CullJob& job, Index prism) const noexcept;

    std::vector<Pixel> picture_;
    std::uint32_t turn_ = 0;
};

} // namespace trocar::collision
