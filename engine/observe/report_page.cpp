#include "engine/observe/report_page.hpp"

#include "engine/io/file_bytes.hpp"
#include "engine/observe/html.hpp"

#include <fmt/format.h>

namespace seldinger::engine {

Result<std::string> make_report_page(const RunRecord& record, const std::vector<TakenPicture>& pictures,
                                     const std::filesystem::path& folder, std::vector<std::string>&) {
    std::string page = fmt::format("<!doctype html><meta charset=\"utf-8\"><title>{0}</title><h1>{0}</h1>",
                                   escape_html(record.scene.name));
    page += fmt::format("<p>{} steps, budget kept in {} of them", record.summary.steps,
                        record.summary.steps - record.summary.overruns);
    for (const TakenPicture& picture : pictures) {
        const Result<std::string> bytes = read_file_bytes(folder / picture.file);
        if (!bytes) return bytes.error();
        page += fmt::format("<img src=\"data:image/png;base64,{}\">", encode_base64(*bytes));
    }
    return page;
}

} // namespace seldinger::engine
