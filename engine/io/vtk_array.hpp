// Binary arrays of VTK XML files: base64, block headers, zlib blocks.
#pragma once

#include "base/result.hpp"
#include "engine/io/scalar.hpp"

#include <cstddef>
#include <string>
#include <string_view>

namespace trocar::engine {

/// What the file says once for all its arrays.
struct VtkArrayFormat {
    std::string_view appended;  // bytes after the '_' of <AppendedData>
    std::size_t file_bytes = 0; // bounds what compressed arrays may unfold to
    bool big = false;           // most significant byte first
    bool long_header = false;   // sizes have 64 bits instead of 32
    bool compressed = false;
    bool raw_appended = false; // appended data are bytes, not base64
};

/// The bytes of one array, whose header stands at the beginning of packed; what follows the array is not read.
/// fails     BadSyntax, without file and line: no base64, cut off, damaged or bomb-like blocks
[[nodiscard]] Result<std::string> unpack_vtk_array(std::string_view packed, const VtkArrayFormat& format, bool raw);

} // namespace trocar::engine
