#include "engine/cli/commands.hpp"
#include "engine/scene/schema.hpp"

#include <cstdio>

namespace seldinger::engine {

int schema_command() {
    std::fputs(scene_schema_text().c_str(), stdout);
    return kExitFine;
}

} // namespace seldinger::engine
