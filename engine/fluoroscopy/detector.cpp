#include "engine/fluoroscopy/detector.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

constexpr double kLeastTransmission = 1e-6; // what a logarithm is taken of at least
constexpr double kFewPhotons = 30.0;
constexpr double kRoadmapShare = 0.5; // of the roadmap's attenuation in the picture under it
constexpr double kWindowShare = 0.02; // of pixels darker, and brighter, than the first frame's own window
constexpr double kLeastWindow = 0.05; // [-] attenuation

/// A bijection of 64 bits without visible structure (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators").
std::uint64_t mix(std::uint64_t x) noexcept {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}
/// In (0, 1).
double uniform(std::uint64_t& stream) noexcept {
    stream = mix(stream);
    return (static_cast<double>(stream >> 11) + 0.5) * 0x1p-53;
}

/// Weights of a Gaussian to both sides of its middle, of sum 1.
std::vector<double> gaussian(double sigma) {
    const int reach = static_cast<int>(std::ceil(3.5 * sigma));
    std::vector<double> weights(static_cast<std::size_t>(reach) + 1);
    double sum = 0.0;
    for (int k = 0; k <= reach; ++k) {
        weights[static_cast<std::size_t>(k)] = std::exp(-0.5 * k * k / (sigma * sigma));
        sum += (k == 0 ? 1.0 : 2.0) * weights[static_cast<std::size_t>(k)];
    }
    for (double& w : weights) w /= sum;
    return weights;
}

/// count lines of `length` values, `apart` from value to value and `next` from line to line.
void blur_lines(std::vector<double>& values, std::size_t count, std::size_t next, std::size_t length, std::size_t apart, double sigma) {
    if (sigma < 0.05) return;
    const std::vector<double> weights = gaussian(std::min(sigma, static_cast<double>(length)));
    const auto reach = static_cast<std::ptrdiff_t>(weights.size()) - 1, last = static_cast<std::ptrdiff_t>(length) - 1;
    std::vector<double> line(length);
    for (std::size_t l = 0; l < count; ++l) {
        double* own = values.data() + l * next;
        for (std::size_t i = 0; i < length; ++i) line[i] = own[i * apart];
        for (std::ptrdiff_t i = 0; i <= last; ++i) {
            double sum = weights[0] * line[static_cast<std::size_t>(i)];
            for (std::ptrdiff_t k = 1; k <= reach; ++k)
                sum += weights[static_cast<std::size_t>(k)] *
                       (line[static_cast<std::size_t>(std::max<std::ptrdiff_t>(i - k, 0))] + line[static_cast<std::size_t>(std::min(i + k, last))]);
            own[static_cast<std::size_t>(i) * apart] = sum;
        }
    }
}

/// Scatter is smooth: it is found on a picture of at most this many columns and rows.
constexpr unsigned kScatterEdge = 64;

void add_scatter(const XrayView& view, Transmission& signal) {
    const unsigned width = view.pixels[0], height = view.pixels[1];
    const unsigned step_x = (width + kScatterEdge - 1) / kScatterEdge, step_y = (height + kScatterEdge - 1) / kScatterEdge;
    const unsigned columns = (width + step_x - 1) / step_x, rows = (height + step_y - 1) / step_y;
    std::vector<double> coarse(std::size_t{columns} * rows, 0.0), share(coarse.size(), 0.0);
    for (unsigned y = 0; y < height; ++y)
        for (unsigned x = 0; x < width; ++x) {
            const std::size_t cell = std::size_t{y / step_y} * columns + x / step_x;
            coarse[cell] += signal[std::size_t{y} * width + x];
            share[cell] += 1.0;
        }
    for (std::size_t k = 0; k < coarse.size(); ++k) coarse[k] /= share[k];
    blur(coarse, columns, rows, view.scatter_width * width / view.detector[0] / step_x, view.scatter_width * height / view.detector[1] / step_y);
    const auto at = [&](double place, unsigned count) { return std::clamp(place, 0.0, static_cast<double>(count - 1)); };
    for (unsigned y = 0; y < height; ++y)
        for (unsigned x = 0; x < width; ++x) {
            const double u = at((x + 0.5) / step_x - 0.5, columns), v = at((y + 0.5) / step_y - 0.5, rows);
            const auto i = static_cast<std::size_t>(u), j = static_cast<std::size_t>(v);
            const std::size_t i1 = std::min<std::size_t>(i + 1, columns - 1), j1 = std::min<std::size_t>(j + 1, rows - 1);
            const double a = u - static_cast<double>(i), b = v - static_cast<double>(j);
            const double smooth = (1.0 - b) * ((1.0 - a) * coarse[j * columns + i] + a * coarse[j * columns + i1]) +
                                  b * ((1.0 - a) * coarse[j1 * columns + i] + a * coarse[j1 * columns + i1]);
            double& own = signal[std::size_t{y} * width + x];
            own = (1.0 - view.scatter) * own + view.scatter * smooth;
        }
}

std::array<double, 2> window_of(std::vector<double> attenuation) {
    const auto rank = [&](double share) {
        const auto at = attenuation.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(attenuation.size() - 1));
        std::nth_element(attenuation.begin(), at, attenuation.end());
        return *at;
    };
    const double white = rank(0.0), black = rank(1.0 - kWindowShare);
    return {white, std::max(black, white + kLeastWindow)};
}

} // namespace

void blur(std::vector<double>& values, unsigned width, unsigned height, double sigma_x, double sigma_y) {
    blur_lines(values, height, width, width, 1, sigma_x);
    blur_lines(values, width, 1, height, width, sigma_y);
}

double count_photons(double expected, std::uint64_t stream) noexcept {
    if (!(expected > 0.0)) return 0.0;
    if (expected < kFewPhotons) {
        double left = uniform(stream), term = std::exp(-expected), count = 0.0;
        while (left > term && count < 400.0) {
            left -= term;
            term *= expected / ++count;
        }
        return count;
    }
    // sum of 12: the normal distribution's moments up to the third, its fourth to 3 %
    double normal = -6.0;
    for (int k = 0; k < 12; ++k) normal += uniform(stream);
    return std::max(0.0, std::floor(expected + normal * std::sqrt(expected) + 0.5));
}

void detect(const XrayView& view, std::span<const double> attenuation, std::uint64_t frame, Transmission& out) {
    out.resize(attenuation.size());
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = attenuation[k] == 0.0 ? 1.0 : std::exp(-attenuation[k]);
    if (view.scatter > 0.0) add_scatter(view, out);
    if (view.blur > 0.0)
        blur(out, view.pixels[0], view.pixels[1], view.blur * view.pixels[0] / view.detector[0], view.blur * view.pixels[1] / view.detector[1]);
    if (!view.noise) return;
    std::uint64_t stream = mix(view.seed);
    for (const char c : view.name) stream = mix(stream ^ static_cast<unsigned char>(c));
    stream = mix(stream ^ frame);
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = count_photons(view.photons * out[k], mix(stream ^ k)) / view.photons;
}

GreyFrame show(const XrayView& view, const Transmission& transmission, double time, Console& console) {
    GreyFrame frame{view.pixels[0], view.pixels[1], bits_of(view), std::vector<std::uint16_t>(transmission.size())};
    const double full = frame.bits == 16 ? 65535.0 : 255.0;
    const auto grey = [&](double share) { return static_cast<std::uint16_t>(std::clamp(share, 0.0, 1.0) * full + 0.5); };
    if (view.display == XrayDisplay::Linear) {
        for (std::size_t k = 0; k < transmission.size(); ++k) frame.values[k] = grey(transmission[k]);
        return frame;
    }
    std::vector<double> dense(transmission.size());
    for (std::size_t k = 0; k < dense.size(); ++k) dense[k] = -std::log(std::max(transmission[k], kLeastTransmission));
    if (console.mask.empty() && time >= view.mask - 1e-9) console.mask = dense;
    console.filled.resize(dense.size(), 0.0);
    for (std::size_t k = 0; console.fills && k < console.mask.size(); ++k) console.filled[k] = std::max(console.filled[k], dense[k] - console.mask[k]);
    const bool subtracts = view.display == XrayDisplay::Subtraction;
    if (!console.window) console.window = view.window ? view.window : subtracts ? std::array{-0.25, 0.75} : window_of(dense);
    const auto [white, black] = *console.window;
    for (std::size_t k = 0; k < dense.size(); ++k) {
        double value = dense[k];
        if (subtracts) value = console.mask.empty() ? 0.0 : value - console.mask[k];
        if (view.display == XrayDisplay::Roadmap) value -= kRoadmapShare * console.filled[k]; // bright, as consoles show it
        frame.values[k] = grey(1.0 - (value - white) / (black - white));
    }
    return frame;
}

} // namespace trocar::engine
