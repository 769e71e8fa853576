// Takes the pictures a scene asks for, when their time comes. All of it is outside the step.
#pragma once

#include "engine/report/picture_scene.hpp"

#include <memory>
#include <string>
#include <vector>

namespace trocar::engine {

struct TakenPicture {
    PictureView view = PictureView::Anatomy;
    double time = 0.0; // s
    std::string file;  // name in the output folder
};

class Photographer {
public:
    /// With the effect fluoroscopy at least one X-ray picture is taken, at the end.
    Photographer(const Scene& scene, std::filesystem::path folder);

    /// Takes what is due at this time. Without OpenGL, or when the driver fails, one notice and no pictures. One that cannot be written is
    /// among failed(), and the others are taken.
    void take_due(const Moment& moment, double time, std::vector<std::string>& notices);
    /// The run ends: what was due later is taken now, once per view.
    void take_rest(const Moment& moment, double time, std::vector<std::string>& notices);

    /// What was due by this time is not taken any more.
    void skip_until(double time) noexcept;
    [[nodiscard]] bool anything_due(double time) const noexcept;
    [[nodiscard]] const std::vector<TakenPicture>& taken() const noexcept { return taken_; }
    /// Pictures that could not be written, and why.
    [[nodiscard]] const std::vector<Error>& failed() const noexcept { return failed_; }
    /// The OpenGL driver's name; empty until the first picture.
    [[nodiscard]] std::string renderer_name() const;

private:
    void take(PictureView view, const Moment& moment, double time, std::vector<std::string>& notices);
    void give_up(const std::string& reason, std::vector<std::string>& notices);

    std::filesystem::path folder_;
    std::vector<PictureSpec> wanted_; // by time, next_ is the first not taken
    std::size_t next_ = 0;
    double tolerance_ = 0.0; // s
    unsigned width_, height_;
    std::vector<TakenPicture> taken_;
    std::vector<Error> failed_;
    std::unique_ptr<Renderer> renderer_;
    bool given_up_ = false;
};

/// "anatomy", "tip", "fluoro".
[[nodiscard]] const char* view_name(PictureView view) noexcept;

} // namespace trocar::engine
