#include "engine/igtl/codec.hpp"

#ifdef TROCAR_OPENIGTLINK

#include "engine/igtl/bytes.hpp"

#include <igtlCapabilityMessage.h>
#include <igtlMessageHeader.h>
#include <igtlPolyDataMessage.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>
#include <igtl_header.h>
#include <igtl_util.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace trocar::engine::igtl {

namespace {

static_assert(kHeaderSize == IGTL_HEADER_SIZE && kLongestName == IGTL_HEADER_NAME_SIZE);

constexpr float kMmPerM = 1000.0f;
/// Places in a header.
constexpr std::size_t kTypeAt = 2, kNameAt = 14, kTimeAt = 34, kSizeAt = 42, kCrcAt = 50;
/// Bytes of a POLYDATA's body before its points.
constexpr std::size_t kCountsSize = 40;
/// Bytes of a TRANSFORM's body: twelve numbers, column by column.
constexpr std::size_t kTransformSize = 48;
/// Bytes of a STRING's body before its text: encoding and length.
constexpr std::size_t kStringStart = 4, kLongestString = 65'535;

std::uint64_t checksum(std::string_view body) noexcept {
    return crc64(reinterpret_cast<unsigned char*>(const_cast<char*>(body.data())), body.size(), 0); // it only reads
}

std::string text_at(std::string_view bytes, std::size_t at, std::size_t size) {
    const std::string_view field = bytes.substr(at, size);
    return std::string(field.substr(0, field.find('\0')));
}

std::uint32_t whole_seconds(double time_s) noexcept { return static_cast<std::uint32_t>(std::clamp(time_s, 0.0, 4e9)); }
std::uint32_t fraction(double time_s) noexcept {
    return static_cast<std::uint32_t>(std::clamp((time_s - whole_seconds(time_s)) * 4294967296.0, 0.0, 4294967295.0));
}

template <class Message>
std::string pack(const typename Message::Pointer& message, const std::string& name, double time_s) {
    message->SetDeviceName(name.c_str());
    message->SetTimeStamp(whole_seconds(time_s), fraction(time_s));
    message->Pack();
    return {static_cast<const char*>(message->GetPackPointer()), static_cast<std::size_t>(message->GetPackSize())};
}

/// The library's own message, of a content that has been measured. Null: it does not take it.
template <class Message>
typename Message::Pointer unpack(const Header& header, std::string_view content) {
    std::string bytes(kHeaderSize, '\0');
    put_number<std::uint16_t>(bytes, 0, 1);
    std::copy_n(header.type.data(), header.type.size(), bytes.data() + kTypeAt);
    std::copy_n(header.name.data(), header.name.size(), bytes.data() + kNameAt);
    put_number<std::uint64_t>(bytes, kSizeAt, content.size());
    put_number<std::uint64_t>(bytes, kCrcAt, checksum(content));
    const auto head = ::igtl::MessageHeader::New();
    head->InitPack();
    std::memcpy(head->GetPackPointer(), bytes.data(), kHeaderSize);
    head->Unpack();
    auto message = Message::New();
    message->SetMessageHeader(head);
    message->AllocatePack();
    if (static_cast<std::size_t>(message->GetPackBodySize()) != content.size()) return nullptr;
    if (!content.empty()) std::memcpy(message->GetPackBodyPointer(), content.data(), content.size());
    if ((message->Unpack(1) & ::igtl::MessageHeader::UNPACK_BODY) == 0) return nullptr;
    return message;
}

} // namespace

bool has_library() noexcept { return true; }

Header read_header(std::string_view bytes) {
    return {get_number<std::uint16_t>(bytes, 0), text_at(bytes, kTypeAt, IGTL_HEADER_TYPE_SIZE), text_at(bytes, kNameAt, kLongestName),
            get_number<std::uint64_t>(bytes, kSizeAt), get_number<std::uint64_t>(bytes, kCrcAt)};
}

bool has_its_checksum(const Header& header, std::string_view body) { return header.crc == checksum(body); }

std::optional<std::string_view> content_of(const Header& header, std::string_view body) {
    if (header.version < 2) return body;
    if (body.size() < 2) return std::nullopt;
    const std::size_t before = get_number<std::uint16_t>(body, 0); // the second header, this size included
    if (before < 12 || before > body.size()) return std::nullopt;
    const std::uint64_t after = std::uint64_t{get_number<std::uint16_t>(body, 2)} + get_number<std::uint32_t>(body, 4);
    if (after > body.size() - before) return std::nullopt;
    return body.substr(before, body.size() - before - after);
}

std::optional<Transform> read_transform(const Header& header, std::string_view content) {
    if (content.size() != kTransformSize) return std::nullopt;
    const auto message = unpack<::igtl::TransformMessage>(header, content);
    if (message.IsNull()) return std::nullopt;
    ::igtl::Matrix4x4 m;
    message->GetMatrix(m);
    const auto column = [&](int k) { return Vec3(m[0][k], m[1][k], m[2][k]); };
    return Transform{column(0), column(1), column(2), column(3) / double{kMmPerM}};
}

std::optional<std::string> read_string(const Header& header, std::string_view content) {
    if (content.size() < kStringStart || get_number<std::uint16_t>(content, 2) != content.size() - kStringStart) return std::nullopt;
    if (content.size() == kStringStart) return std::string();
    const auto message = unpack<::igtl::StringMessage>(header, content);
    if (message.IsNull()) return std::nullopt;
    return std::string(message->GetString());
}

std::string pack_transform(const std::string& name, double time_s, const Transform& transform) {
    ::igtl::Matrix4x4 m = {{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 1}};
    for (int row = 0; row < 3; ++row) {
        m[row][0] = static_cast<float>(transform.x[row]);
        m[row][1] = static_cast<float>(transform.y[row]);
        m[row][2] = static_cast<float>(transform.z[row]);
        m[row][3] = static_cast<float>(double{kMmPerM} * transform.origin[row]);
    }
    const auto message = ::igtl::TransformMessage::New();
    message->SetMatrix(m);
    return pack<::igtl::TransformMessage>(message, name, time_s);
}

std::string pack_string(const std::string& name, double time_s, const std::string& text) {
    const auto message = ::igtl::StringMessage::New();
    message->SetEncoding(106); // UTF-8, as IANA numbers it
    message->SetString(text.substr(0, kLongestString).c_str());
    return pack<::igtl::StringMessage>(message, name, time_s);
}

std::string pack_status(const std::string& name, double time_s, Status code, const std::string& text) {
    const auto message = ::igtl::StatusMessage::New();
    message->SetCode(static_cast<int>(code));
    message->SetSubCode(0);
    message->SetErrorName("");
    message->SetStatusString(text.c_str());
    return pack<::igtl::StatusMessage>(message, name, time_s);
}

std::string pack_capability(const std::string& name, const std::vector<std::string>& types) {
    const auto message = ::igtl::CapabilityMessage::New();
    message->SetTypes(types);
    return pack<::igtl::CapabilityMessage>(message, name, 0.0);
}

std::string pack_surface(const std::string& name, double time_s, std::span<const Point> points, std::span<const Triangle> triangles) {
    const auto array = ::igtl::PolyDataPointArray::New();
    for (const Point& p : points) array->AddPoint(kMmPerM * p[0], kMmPerM * p[1], kMmPerM * p[2]);
    const auto cells = ::igtl::PolyDataCellArray::New();
    for (const Triangle& t : triangles) {
        igtlUint32 corners[3] = {t[0], t[1], t[2]};
        cells->AddCell(3, corners);
    }
    const auto message = ::igtl::PolyDataMessage::New();
    message->SetPoints(array);
    message->SetPolygons(cells);
    return pack<::igtl::PolyDataMessage>(message, name, time_s);
}

std::string move_surface(const std::string& packed, double time_s, std::span<const Point> points) {
    std::string bytes = packed;
    std::size_t at = kHeaderSize + kCountsSize;
    for (const Point& p : points)
        for (std::size_t axis = 0; axis < 3; ++axis, at += sizeof(float))
            put_number(bytes, at, std::bit_cast<std::uint32_t>(kMmPerM * p[axis]));
    put_number(bytes, kTimeAt, whole_seconds(time_s));
    put_number(bytes, kTimeAt + 4, fraction(time_s));
    put_number(bytes, kCrcAt, checksum(std::string_view(bytes).substr(kHeaderSize)));
    return bytes;
}

} // namespace trocar::engine::igtl

#else

namespace trocar::engine::igtl {

bool has_library() noexcept { return false; }
Header read_header(std::string_view) { return {}; }
bool has_its_checksum(const Header&, std::string_view) { return false; }
std::optional<std::string_view> content_of(const Header&, std::string_view) { return std::nullopt; }
std::optional<Transform> read_transform(const Header&, std::string_view) { return std::nullopt; }
std::optional<std::string> read_string(const Header&, std::string_view) { return std::nullopt; }
std::string pack_transform(const std::string&, double, const Transform&) { return {}; }
std::string pack_string(const std::string&, double, const std::string&) { return {}; }
std::string pack_status(const std::string&, double, Status, const std::string&) { return {}; }
std::string pack_capability(const std::string&, const std::vector<std::string>&) { return {}; }
std::string pack_surface(const std::string&, double, std::span<const Point>, std::span<const Triangle>) { return {}; }
std::string move_surface(const std::string&, double, std::span<const Point>) { return {}; }

} // namespace trocar::engine::igtl

#endif
