// The detector: Beer-Lambert, counted photons, blur and scatter that keep the signal, displays, and files that other programs read.
#include "engine/fluoroscopy/detector.hpp"
#include "engine/fluoroscopy/dicom.hpp"
#include "engine/fluoroscopy/film.hpp"
#include "engine/fluoroscopy/grey_png.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <numeric>

namespace trocar::engine {
namespace {

XrayView small_view() {
    XrayView view;
    view.name = "ap";
    view.pixels = {64, 48};
    return view;
}

std::vector<double> half_covered(const XrayView& view, double attenuation) {
    std::vector<double> values(view.pixel_count(), 0.0);
    for (std::size_t k = 0; k < values.size(); ++k)
        if (k % view.pixels[0] >= view.pixels[0] / 2) values[k] = attenuation;
    return values;
}

double mean(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size()); }

TEST(Detector, TransmissionIsBeerLamberts) {
    const XrayView view = small_view();
    Transmission signal;
    detect(view, half_covered(view, 1.5), 0, signal);
    EXPECT_EQ(signal.front(), 1.0);
    EXPECT_NEAR(signal[60], std::exp(-1.5), 1e-15);
    Console console;
    const GreyFrame frame = show(view, signal, 0.0, console);
    EXPECT_EQ(frame.bits, 16u);
    EXPECT_EQ(frame.values.front(), 65535) << "full scale is the open beam";
    EXPECT_EQ(frame.values[60], static_cast<std::uint16_t>(std::lround(65535 * std::exp(-1.5))));
}

TEST(Detector, PhotonsAreCountedAsPoissonsLawSays) {
    for (const double expected : {0.3, 2.0, 12.0, 29.0, 31.0, 400.0, 20000.0}) {
        constexpr int kCount = 40000;
        double sum = 0.0, square = 0.0;
        for (int k = 0; k < kCount; ++k) {
            const double n = count_photons(expected, 1000003u * static_cast<std::uint64_t>(k) + 17u);
            EXPECT_EQ(n, std::floor(n));
            sum += n;
            square += n * n;
        }
        const double average = sum / kCount, variance = square / kCount - average * average;
        EXPECT_NEAR(average, expected, 5.0 * std::sqrt(expected / kCount)) << expected;
        EXPECT_NEAR(variance / expected, 1.0, 0.05) << expected;
    }
    EXPECT_EQ(count_photons(0.0, 5), 0.0);
}

TEST(Detector, TheSameSeedGivesTheSameNoiseAndAnotherFrameOther) {
    XrayView view = small_view();
    view.noise = true;
    const std::vector<double> attenuation = half_covered(view, 1.0);
    Transmission a, b, c, d;
    detect(view, attenuation, 7, a);
    detect(view, attenuation, 7, b);
    detect(view, attenuation, 8, c);
    view.seed = 2;
    detect(view, attenuation, 7, d);
    EXPECT_EQ(a, b);
    EXPECT_NE(a, c);
    EXPECT_NE(a, d);
}

TEST(Detector, BlurAndScatterKeepTheMeanSignal) {
    XrayView view = small_view();
    Transmission plain, blurred, scattered;
    const std::vector<double> attenuation = half_covered(view, 2.0);
    detect(view, attenuation, 0, plain);
    view.blur = 0.01;
    detect(view, attenuation, 0, blurred);
    view.blur = 0.0, view.scatter = 0.4;
    detect(view, attenuation, 0, scattered);
    EXPECT_NEAR(mean(blurred), mean(plain), 1e-3);
    EXPECT_NEAR(mean(scattered), mean(plain), 1e-2);
    EXPECT_LT(scattered[29], plain[29]) << "less contrast";
    EXPECT_GT(scattered[34], plain[34]);
    EXPECT_NEAR(0.5 * (blurred[31] + blurred[32]), 0.5 * (1.0 + std::exp(-2.0)), 1e-9) << "an edge is half way up at its place";
    std::vector<double> point(31 * 31, 0.0);
    point[15 * 31 + 15] = 1.0;
    blur(point, 31, 31, 2.0, 2.0);
    double sum = 0.0, second = 0.0;
    for (int y = 0; y < 31; ++y)
        for (int x = 0; x < 31; ++x) sum += point[y * 31 + x], second += point[y * 31 + x] * (x - 15) * (x - 15);
    EXPECT_NEAR(sum, 1.0, 1e-12);
    EXPECT_NEAR(std::sqrt(second), 2.0, 0.02);
}

TEST(Detector, LogarithmsWindowSubtractionAndRoadmap) {
    XrayView view = small_view();
    view.display = XrayDisplay::Log;
    view.window = {0.0, 2.0};
    Transmission signal;
    detect(view, half_covered(view, 1.0), 0, signal);
    Console log;
    GreyFrame frame = show(view, signal, 0.0, log);
    EXPECT_EQ(frame.bits, 8u);
    EXPECT_EQ(frame.values[0], 255);
    EXPECT_EQ(frame.values[60], 128) << "the window's middle";

    view.display = XrayDisplay::Subtraction;
    view.mask = 1.0;
    Console subtraction;
    EXPECT_EQ(show(view, signal, 0.5, subtraction).values[60], 255) << "no mask yet: nothing to show";
    EXPECT_EQ(show(view, signal, 1.0, subtraction).values[60], 255) << "the mask minus itself";
    Transmission filled;
    detect(view, half_covered(view, 2.0), 1, filled);
    frame = show(view, filled, 1.5, subtraction);
    EXPECT_EQ(frame.values[0], 255);
    EXPECT_EQ(frame.values[60], 128) << "an attenuation of 1 was added, whatever lay under it";

    view.display = XrayDisplay::Roadmap;
    Console roadmap;
    const GreyFrame before = show(view, signal, 1.0, roadmap);
    (void)show(view, filled, 1.5, roadmap);
    const GreyFrame after = show(view, signal, 2.0, roadmap); // the contrast has gone
    EXPECT_GT(after.values[60], before.values[60]) << "where it was stays marked";
    EXPECT_EQ(after.values[0], before.values[0]);
}

std::uint32_t big(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
    return value;
}

GreyFrame ramp(unsigned width, unsigned height, unsigned bits) {
    GreyFrame frame{width, height, bits, std::vector<std::uint16_t>(std::size_t{width} * height)};
    for (std::size_t k = 0; k < frame.values.size(); ++k) frame.values[k] = static_cast<std::uint16_t>(k * 37 % (bits == 16 ? 65536 : 256));
    return frame;
}

TEST(Files, APngIsGreyAndOfItsBits) {
    for (const unsigned bits : {8u, 16u}) {
        const Result<std::string> png = encode_grey_png(ramp(13, 7, bits));
        ASSERT_TRUE(png.ok());
        EXPECT_EQ(big(*png, 16), 13u);
        EXPECT_EQ(big(*png, 20), 7u);
        EXPECT_EQ(static_cast<unsigned char>((*png)[24]), bits);
        EXPECT_EQ((*png)[25], 0) << "grey";
    }
    EXPECT_FALSE(encode_grey_png(GreyFrame{0, 0, 8, {}}).ok());
    EXPECT_FALSE(encode_grey_png(GreyFrame{2, 2, 8, {1, 2, 3}}).ok());
}

TEST(Files, AFilmHoldsItsFramesInOrder) {
    const std::vector<GreyFrame> frames{ramp(13, 7, 8), ramp(13, 7, 8), ramp(13, 7, 8)};
    const Result<std::string> film = encode_film(frames, 0.1);
    ASSERT_TRUE(film.ok());
    std::string order;
    for (std::size_t at = 8; at + 12 <= film->size(); at += 12 + big(*film, at)) {
        const std::string type = film->substr(at + 4, 4);
        const std::uint32_t length = big(*film, at);
        const auto sum = static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(film->data() + at + 4), length + 4));
        EXPECT_EQ(sum, big(*film, at + 8 + length)) << type;
        order += type + " ";
    }
    EXPECT_EQ(order, "IHDR acTL fcTL IDAT fcTL fdAT fcTL fdAT IEND ");
    EXPECT_FALSE(encode_film({}, 0.1).ok());
    const std::vector<GreyFrame> mixed{ramp(13, 7, 8), ramp(12, 7, 8)};
    EXPECT_FALSE(encode_film(mixed, 0.1).ok());
}

TEST(Files, ADicomFileTellsTheGeometryItWasMadeWith) {
    XrayView view = small_view();
    view.primary = 0.5235987755982988, view.secondary = -0.3490658503988659; // LAO 30, CAU 20
    view.sid = 1.1, view.sod = 0.72, view.detector = {0.24, 0.3};
    DicomSeries series{"a scene", 0.1, {{view.primary, view.secondary}, {view.primary, view.secondary}}, {ramp(64, 48, 16), ramp(64, 48, 16)}};
    const Result<std::string> bytes = encode_dicom(view, series);
    ASSERT_TRUE(bytes.ok());
    const Result<XrayView> read = read_dicom_view(*bytes, "a.dcm");
    ASSERT_TRUE(read.ok()) << read.error().to_string();
    EXPECT_NEAR(read->primary, view.primary, 1e-9);
    EXPECT_NEAR(read->secondary, view.secondary, 1e-9);
    EXPECT_NEAR(read->sid, view.sid, 1e-9);
    EXPECT_NEAR(read->sod, view.sod, 1e-9);
    EXPECT_NEAR(read->detector[0], 0.24, 1e-9);
    EXPECT_NEAR(read->detector[1], 0.3, 1e-9);
    EXPECT_EQ(read->pixels, view.pixels);
    EXPECT_EQ(bytes->size() % 2, 0u);
    const auto orientation = [](std::string_view letters) { return std::string("\x20\0\x20\0CS", 6) + static_cast<char>(letters.size()) + '\0' + std::string(letters); };
    EXPECT_NE(bytes->find(orientation("LP\\F")), std::string::npos) << "columns run to the patient's left and back";
    EXPECT_NE(encode_dicom(small_view(), {"s", 0.1, {{0, 0}}, {ramp(64, 48, 8)}})->find(orientation("L\\F ")), std::string::npos);
    EXPECT_EQ(*encode_dicom(view, series), *bytes) << "the same frames give the same bytes";
}

TEST(Files, DamagedDicomFilesAreRefused) {
    XrayView view = small_view();
    const Result<std::string> bytes = encode_dicom(view, {"s", 0.1, {{0, 0}}, {ramp(64, 48, 8)}});
    ASSERT_TRUE(bytes.ok());
    const std::size_t pixels = bytes->size() - 64 * 48 - 12;
    std::size_t refused = 0;
    for (std::size_t k = 0; k < pixels; k += 3) refused += !read_dicom_view(bytes->substr(0, k), "a.dcm").ok();
    EXPECT_GT(refused, pixels / 3 - 100);
    std::uint32_t random = 1;
    for (int k = 0; k < 3000; ++k) { // none may crash; those that are still read have distances of a C-arm
        std::string damaged = *bytes;
        for (int n = 0; n < 4; ++n) {
            random = random * 1664525u + 1013904223u;
            damaged[132 + random % (pixels - 132)] = static_cast<char>(random >> 24);
        }
        const auto read = read_dicom_view(damaged, "a.dcm");
        if (read.ok()) {
            EXPECT_GT(read->sid, read->sod);
        }
    }
    EXPECT_FALSE(read_dicom_view("", "a.dcm").ok());
    EXPECT_FALSE(encode_dicom(view, {}).ok());
}

} // namespace
} // namespace trocar::engine
