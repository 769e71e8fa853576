#include "engine/importing/import_segmentation.hpp"

#include <fmt/format.h>

namespace trocar::engine {

Result<SegmentSurface> read_segment(const std::filesystem::path& file, const std::string& label, const LabelSurfaceOptions& options,
                                    const std::function<void(const std::string&)>& progress) {
    SegmentSurface segment;
    Result<LabelMask> mask = [&]() -> Result<LabelMask> {
        const Result<LabelVolume> volume = read_label_volume(file);
        if (!volume.ok()) return volume.error();
        segment.facts.emplace_back("voxels", fmt::format("{} x {} x {}, {:.4g} x {:.4g} x {:.4g} mm", volume->size[0], volume->size[1], volume->size[2],
                                                         1e3 * volume->spacing(0), 1e3 * volume->spacing(1), 1e3 * volume->spacing(2)));
        for (const std::string& note : volume->notes) segment.facts.emplace_back("assumed", note);
        return make_mask(*volume, label); // the volume goes here: only the mask stays in memory
    }();
    if (!mask.ok()) return mask.error();
    segment.facts.emplace_back("segment", mask->name);
    const Result<LabelSurface> surface = make_label_surface(*mask, options, progress);
    if (!surface.ok()) return surface.error();
    segment.facts.emplace_back("cut", surface->told());
    segment.mesh = surface->mesh;
    segment.repairs = std::move(mask->repairs);
    if (!mask->cut.empty()) segment.repairs.push_back(fmt::format("open_ends: {} where the volume's sides cut the segment, capped", mask->cut.size()));
    segment.cut = std::move(mask->cut);
    return segment;
}

} // namespace trocar::engine
