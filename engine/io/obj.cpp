// Wavefront OBJ: v, f, g, o; everything else that the format knows is passed over.
#include "engine/io/formats.hpp"
#include "engine/io/scanner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace trocar::engine {
namespace {

constexpr std::size_t kListedNames = 64; // of known groups, in messages

/// Statements without geometry of ours: normals, materials, free-form curves and surfaces.
constexpr std::array kPassedOver = {"vt",     "vn",       "vp",       "s",          "usemtl",   "mtllib", "l",     "p",      "mg",
                                    "cstype", "deg",      "bmat",     "step",       "curv",     "curv2",  "surf",  "parm",   "trim",
                                    "hole",   "scrv",     "sp",       "end",        "con",      "bevel",  "lod",   "call",   "csh",
                                    "bsp",    "bzp",      "cdc",      "cdp",        "res",      "ctech",  "stech", "usemap", "maplib",
                                    "fo",     "c_interp", "d_interp", "shadow_obj", "trace_obj"};

class ObjReader {
public:
    ObjReader(std::string_view bytes, const std::string& name, std::span<const std::string> keep)
        : in_(bytes, name), name_(name), keep_(keep) {
        in_.set_comment('#');
        in_.set_continuation(true);
        // A line of a vertex or a triangle takes about 30 bytes; a wrong guess only costs a copy.
        out_.mesh.vertices.reserve(bytes.size() / 100);
        out_.mesh.triangles.reserve(bytes.size() / 60);
        kept_object_ = is_kept(object_);
    }

    Result<GroupedSurface> read() {
        while (!in_.at_end())
            if (!read_statement()) return in_.error();
        if (!check_forward_references()) return in_.error();
        for (const std::string& wanted : keep_)
            if (!out_.groups.contains(wanted)) return unknown_group(wanted);
        if (out_.mesh.triangles.empty()) return Error{ErrorCode::BadMesh, "holds no face", name_};
        return std::move(out_);
    }

private:
    bool read_statement() {
        std::string_view keyword;
        if (!in_.word(keyword, "a statement")) return false;
        if (keyword == "v") {
            if (out_.mesh.vertices.size() >= kNoIndex) return in_.fail(ErrorCode::BadMesh, "more vertices than indices");
            Vec3 position;
            if (!point_of_line(position)) return false;
            out_.mesh.vertices.push_back(position);
            in_.skip_line(); // a weight or colours may follow
            return true;
        }
        if (keyword == "f" || keyword == "fo") return read_face();
        if (keyword == "g" || keyword == "group") return read_group();
        if (keyword == "o") {
            object_ = in_.rest_of_line();
            kept_object_ = is_kept(object_);
            noted_object_ = object_.empty();
            return true;
        }
        return pass_over(keyword);
    }

    bool point_of_line(Vec3& position) {
        if (in_.at_line_end()) return in_.fail(ErrorCode::BadSyntax, "a vertex without coordinates");
        return in_.point(position, out_.mesh.vertices.size() + 1);
    }

    bool read_face() {
        corners_.clear();
        while (!in_.at_line_end()) {
            Index corner = 0;
            if (!read_corner(corner)) return false;
            corners_.push_back(corner);
        }
        if (corners_.empty()) return in_.fail(ErrorCode::BadSyntax, "a face without vertices");
        if (corners_.size() < 3) return true; // bounds no area
        note_names();
        if (keep_.empty() || kept_object_ || kept_groups_) add_fan(out_.mesh.triangles, corners_);
        return true;
    }

    /// v, v/vt, v//vn or v/vt/vn, 1-based or, negative, counted back from the last vertex. Only v matters.
    bool read_corner(Index& corner) {
        std::string_view text;
        if (!in_.word(text, "a vertex index")) return false;
        std::int64_t id = 0;
        const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), id);
        if (status != std::errc{} || (stop != text.data() + text.size() && *stop != '/'))
            return in_.fail(ErrorCode::BadSyntax, fmt::format("'{}' is not a vertex index", text.substr(0, 40)));
        const auto known = static_cast<std::int64_t>(out_.mesh.vertices.size());
        const std::int64_t index = id < 0 ? known + id : id - 1;
        if (id == 0 || index < 0 || index >= static_cast<std::int64_t>(kNoIndex))
            return in_.fail(ErrorCode::BadMesh, fmt::format("vertex index {} with {} vertices so far", id, known));
        corner = static_cast<Index>(index);
        if (index >= known && index > furthest_) { // the vertex may still come
            furthest_ = index;
            furthest_position_ = in_.token_position();
        }
        return true;
    }

    bool check_forward_references() {
        const auto known = static_cast<std::int64_t>(out_.mesh.vertices.size());
        if (furthest_ < known) return true;
        return in_.fail_at(furthest_position_, ErrorCode::BadMesh,
                           fmt::format("vertex index {}, but the file has {} vertices", furthest_ + 1, known));
    }

    bool read_group() {
        groups_.clear();
        kept_groups_ = noted_groups_ = false;
        while (!in_.at_line_end()) {
            std::string_view name;
            if (!in_.word(name, "a group name")) return false;
            groups_.emplace_back(name);
            kept_groups_ = kept_groups_ || is_kept(groups_.back());
        }
        return true;
    }

    bool is_kept(const std::string& name) const { return std::ranges::find(keep_, name) != keep_.end(); }

    /// Names count from their first face on; once for each statement that names them, so that time stays linear.
    void note_names() {
        if (!noted_object_) out_.groups.insert(object_);
        if (!noted_groups_) out_.groups.insert(groups_.begin(), groups_.end());
        noted_object_ = noted_groups_ = true;
    }

    /// Unknown statements before the first vertex are a preface that some files have; later ones would be lost geometry.
    bool pass_over(std::string_view keyword) {
        if (std::ranges::find(kPassedOver, keyword) == kPassedOver.end() && !out_.mesh.vertices.empty())
            return in_.fail(ErrorCode::BadSyntax, fmt::format("'{}' is no statement of an OBJ file", printable(keyword)));
        while (!in_.at_line_end()) { // word by word: the line may be continued
            std::string_view rest;
            if (!in_.word(rest, "a word")) return false;
        }
        return true;
    }

    static std::string printable(std::string_view word) {
        std::string text(word.substr(0, 40));
        std::ranges::replace_if(
            text, [](char c) { return c < ' ' || c > '~'; }, '?');
        return text;
    }

    Error unknown_group(const std::string& wanted) const {
        if (out_.groups.empty()) return {ErrorCode::BadValue, "has no group '" + wanted + "': its faces are in no group", name_};
        std::string known;
        std::size_t listed = 0;
        for (const std::string& group : out_.groups)
            if (listed < kListedNames) known += (listed++ > 0 ? ", " : "") + printable(group);
        if (out_.groups.size() > listed) known += " and " + std::to_string(out_.groups.size() - listed) + " more";
        return {ErrorCode::BadValue, "has no group '" + wanted + "'; it has " + known, name_};
    }

    Scanner in_;
    const std::string& name_;
    std::span<const std::string> keep_;
    GroupedSurface out_;
    std::string object_;
    std::vector<std::string> groups_;
    bool kept_object_ = false, kept_groups_ = false; // one of the names in force is wanted
    bool noted_object_ = true, noted_groups_ = true; // they are in out_.groups, or there are none
    std::vector<Index> corners_;
    std::int64_t furthest_ = -1; // largest index that no vertex had yet
    std::size_t furthest_position_ = 0;
};

} // namespace

Result<GroupedSurface> parse_obj(std::string_view bytes, const std::string& name, std::span<const std::string> keep) {
    return ObjReader(bytes, name, keep).read();
}

} // namespace trocar::engine
