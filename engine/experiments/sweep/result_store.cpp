#include "engine/experiments/sweep/result_store.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/gzip.hpp"
#include "engine/state/bit_hash.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace trocar::engine {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::string_view kChunk = "chunk-";
constexpr std::size_t kSumDigits = 16;
/// Lines of a chunk at most: 500 runs of some KB each, and room for cost.json's many rows.
constexpr std::size_t kMostLineBytes = std::size_t{64} << 20;

std::string checksum(std::string_view text) {
    BitHash hash;
    hash.add_text(text);
    return fmt::format("{:016x}", hash.value());
}

Error cannot_write(const fs::path& path, int reason) {
    return {ErrorCode::CannotWrite, fmt::format("cannot be written: {}", std::strerror(reason)), path.string()};
}

std::string chunk_name(std::uint64_t chunk) { return fmt::format("{}{:07}", kChunk, chunk); }

/// Takes what a file holds into the results, where the plan knows it and nothing was there before.
void take_lines(std::string_view text, const SweepPlan& plan, std::uint64_t first, std::uint64_t end, ChunkResults& results) {
    while (!text.empty()) {
        const std::size_t line_end = text.find('\n');
        if (line_end == std::string_view::npos) return; // cut off
        const std::string_view line = text.substr(0, line_end);
        text.remove_prefix(line_end + 1);
        if (line.size() > kMostLineBytes) continue;
        auto result = parse_result_line(line);
        if (!result || result->run < first || result->run >= end || results.runs.contains(result->run)) continue;
        if (result->values.size() != plan.collect.size() || result->key != plan.run(result->run).key) continue;
        results.runs.emplace(result->run, std::move(*result));
    }
}

/// Parts that no worker writes to.
void remove_left(const std::vector<fs::path>& parts) {
    for (const fs::path& part : parts) {
        std::error_code gone;
        if (!is_locked(part)) fs::remove(part, gone);
    }
}

} // namespace

std::string result_line(const RunResult& result) {
    Json json{{"run", result.run}, {"key", result.key}, {"status", result.status}, {"values", result.values}};
    json["figures"] = Json::parse(result.figures, nullptr, false);
    if (json["figures"].is_discarded()) json["figures"] = nullptr;
    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    return checksum(text) + " " + text + "\n";
}

std::optional<RunResult> parse_result_line(std::string_view line) {
    if (line.size() < kSumDigits + 2 || line[kSumDigits] != ' ') return std::nullopt;
    const std::string_view text = line.substr(kSumDigits + 1);
    if (checksum(text) != line.substr(0, kSumDigits)) return std::nullopt;
    const Json json = Json::parse(text, nullptr, false);
    try { // of the JSON library
        return RunResult{json.at("run").get<std::uint64_t>(), json.at("key").get<std::string>(), json.at("status").get<std::string>(),
                         json.at("values").get<std::vector<std::string>>(), json.at("figures").dump()};
    } catch (const nlohmann::json::exception&) {
        return std::nullopt;
    }
}

fs::path ResultStore::packed_file(std::uint64_t chunk) const { return folder_ / sweep_name::kResults / (chunk_name(chunk) + ".jsonl.gz"); }

ResultStore::Parts ResultStore::find_begun() const {
    Parts begun;
    std::error_code failed;
    for (fs::directory_iterator it(folder_ / sweep_name::kResults, failed), end; !failed && it != end; it.increment(failed)) {
        const std::string name = it->path().filename().string();
        std::error_code unknown;
        if (!name.starts_with(kChunk) || !it->is_regular_file(unknown)) continue; // a pipe would be waited for
        std::vector<fs::path>& parts = begun[std::strtoull(name.c_str() + kChunk.size(), nullptr, 10)];
        if (name.ends_with(".part")) parts.push_back(it->path());
    }
    for (auto& [chunk, parts] : begun) std::sort(parts.begin(), parts.end());
    return begun;
}

ChunkResults ResultStore::read(std::uint64_t chunk, const Parts& begun) const {
    ChunkResults results;
    const auto found = begun.find(chunk);
    if (found == begun.end()) return results;
    const auto [first, end] = plan_.chunk(chunk);
    std::error_code none;
    results.parts = found->second; // read before the packed file: a worker that packs meanwhile removes them only after that is there
    std::vector<std::string> texts;
    for (const fs::path& part : results.parts) {
        results.is_worked_on = results.is_worked_on || is_locked(part);
        if (auto text = read_file_bytes(part)) texts.push_back(std::move(*text));
    }
    if (fs::is_regular_file(packed_file(chunk), none))
        if (const auto text = read_file_bytes(packed_file(chunk))) {
            take_lines(*text, plan_, first, end, results);
            results.is_packed = results.runs.size() == end - first;
        }
    for (const std::string& text : texts) take_lines(text, plan_, first, end, results);
    return results;
}

Result<void> ResultStore::pack(std::uint64_t chunk, const ChunkResults& results) const {
    std::string text;
    for (const auto& [run, result] : results.runs) text += result_line(result);
    auto packed = gzip_bytes(text);
    if (!packed) return packed.error();
    // a chunk that compresses better than a reader believes stays as text
    const bool plain = text.size() > max_unfolded_bytes(packed->size());
    if (auto written = write_file_atomically(packed_file(chunk), plain ? text : *packed); !written) return written;
    remove_left(results.parts);
    return {};
}

Result<void> ResultStore::pack_complete() const {
    const Parts begun = find_begun();
    std::uint64_t complete = 0;
    for (const auto& [chunk, parts] : begun) {
        if (chunk >= plan_.chunk_count()) continue;
        std::error_code none;
        complete += parts.empty() && fs::exists(packed_file(chunk), none);
        if (parts.empty()) continue;
        const ChunkResults results = read(chunk, begun);
        const auto [first, end] = plan_.chunk(chunk);
        if (results.runs.size() != end - first) continue;
        ++complete;
        if (!results.is_packed)
            if (auto packed = pack(chunk, results); !packed) return packed.error();
        for (const fs::path& part : parts) { // an orphan that still writes there has nothing to add
            std::error_code gone;
            fs::remove(part, gone);
        }
    }
    if (complete == plan_.chunk_count()) remove_temporaries(folder_ / sweep_name::kResults); // who still writes there has nothing to add
    return {};
}

Result<std::size_t> ResultStore::drop_failed() const {
    std::size_t dropped = 0;
    const Parts begun = find_begun();
    for (const auto& [chunk, parts] : begun) {
        if (chunk >= plan_.chunk_count()) continue;
        ChunkResults results = read(chunk, begun);
        const std::size_t failed = std::erase_if(results.runs, [](const auto& one) { return one.second.status != "done"; });
        dropped += failed;
        if (failed > 0)
            if (auto packed = pack(chunk, results); !packed) return packed.error();
    }
    return dropped;
}

Result<PartFile> PartFile::create(const fs::path& folder, std::uint64_t chunk) {
    char host[256] = {};
    if (gethostname(host, sizeof host - 1) != 0) host[0] = '\0';
    const fs::path results = folder / sweep_name::kResults;
    std::error_code failed;
    fs::create_directories(results, failed);
    for (int attempt = 0; attempt < 1000; ++attempt) {
        const fs::path path = results / fmt::format("{}.{}-{}-{}.part", chunk_name(chunk), host, getpid(), attempt);
        const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file < 0 && errno == EEXIST) continue;
        if (file < 0) return cannot_write(path, errno);
        (void)::flock(file, LOCK_EX | LOCK_NB); // where there are no locks, it only cannot be told that it is worked on
        return PartFile(path, file);
    }
    return cannot_write(results, EEXIST);
}

PartFile::PartFile(PartFile&& other) noexcept : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)), size_(other.size_) {}

PartFile::~PartFile() {
    if (file_ >= 0) ::close(file_);
}

Result<void> PartFile::add(const RunResult& result) {
    const std::string line = result_line(result);
    for (std::size_t done = 0; done < line.size();) {
        const ssize_t written = ::write(file_, line.data() + done, line.size() - done);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) {
            const int reason = written < 0 ? errno : ENOSPC;
            (void)!::ftruncate(file_, static_cast<off_t>(size_));
            (void)::lseek(file_, static_cast<off_t>(size_), SEEK_SET);
            return cannot_write(path_, reason);
        }
        done += static_cast<std::size_t>(written);
    }
    if (::fdatasync(file_) != 0 && errno != EINVAL && errno != EROFS) return cannot_write(path_, errno); // a quota may show only now
    size_ += line.size();
    return {};
}

bool is_locked(const fs::path& file) {
    const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (descriptor < 0) return false;
    const bool locked = ::flock(descriptor, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    ::close(descriptor);
    return locked;
}

} // namespace trocar::engine
