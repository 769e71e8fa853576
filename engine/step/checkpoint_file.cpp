#include "engine/step/checkpoint.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/state/bit_hash.hpp"
#include "engine/state/byte_stream.hpp"

#include <fmt/format.h>

namespace trocar::engine {

namespace {

constexpr std::string_view kKind = "trocar-checkpoint\n";
/// Changes whenever the meaning of the bytes does, the state's included: nothing is guessed from an older one.
constexpr std::uint32_t kVersion = 18;
constexpr std::size_t kHashBytes = 8;

std::uint64_t hash_of(std::string_view bytes) noexcept {
    BitHash hash;
    hash.add_bytes(bytes);
    return hash.value();
}

template <class Stream, class Any>
void pass_head(Stream& stream, Any& checkpoint) {
    stream.number(checkpoint.model_hash);
    stream.text(checkpoint.scene);
    stream.number(checkpoint.limits.mode), stream.number(checkpoint.limits.wall_s), stream.number(checkpoint.limits.work_units);
    stream.number(checkpoint.step);
}

Error refuse(const std::filesystem::path& file, std::string message) { return {ErrorCode::BadSyntax, std::move(message), file.string()}; }

} // namespace

std::string checkpoint_bytes(const Checkpoint& checkpoint) {
    std::string bytes(kKind);
    ByteWriter stream(bytes);
    stream.number(kVersion);
    pass_head(stream, checkpoint);
    stream.number(static_cast<std::uint64_t>(checkpoint.state.size()));
    bytes += checkpoint.state;
    stream.number(hash_of(bytes));
    return bytes;
}

Result<Checkpoint> parse_checkpoint(std::string_view bytes, const std::filesystem::path& file) {
    if (!bytes.starts_with(kKind)) return refuse(file, "is no checkpoint; expected a file that run --checkpoint-every wrote");
    ByteReader stream(bytes.substr(kKind.size()));
    std::uint32_t version = 0;
    stream.number(version);
    if (stream.ok() && version != kVersion)
        return refuse(file, fmt::format("is a checkpoint of version {}; this program reads version {}", version, kVersion));
    Checkpoint checkpoint;
    std::uint64_t size = 0, hash = 0;
    pass_head(stream, checkpoint);
    stream.number(size);
    if (!stream.ok() || stream.left() < kHashBytes || size != stream.left() - kHashBytes)
        return refuse(file, "the checkpoint is not as long as it says: it was cut off or changed");
    const std::size_t end = bytes.size() - kHashBytes;
    ByteReader(bytes.substr(end)).number(hash);
    if (hash != hash_of(bytes.substr(0, end)))
        return refuse(file, "the checkpoint was changed after it was written: its hash does not fit");
    if (checkpoint.limits.mode > BudgetMode::Exact) return refuse(file, "the checkpoint's budget is of no known kind");
    checkpoint.state = bytes.substr(end - size, size);
    return checkpoint;
}

Result<void> write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint) {
    return write_file_atomically(file, checkpoint_bytes(checkpoint));
}

Result<Checkpoint> read_checkpoint(const std::filesystem::path& file) {
    const auto bytes = read_file_bytes(file);
    if (!bytes.ok()) return bytes.error();
    return parse_checkpoint(*bytes, file);
}

} // namespace trocar::engine
