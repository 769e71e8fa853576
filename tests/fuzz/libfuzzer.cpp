// One target under libFuzzer: TROCAR_FUZZ_TARGET names it. With TROCAR_FUZZ_SEEDS=FOLDER its seeds are written there first.
#include "targets.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace {

const trocar::fuzz::Target* chosen = nullptr;

void write_seeds(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    int number = 0;
    for (const std::string& seed : trocar::fuzz::seeds_of(chosen->name))
        std::ofstream(folder / ("seed" + std::to_string(number++)), std::ios::binary)
            .write(seed.data(), static_cast<std::streamsize>(seed.size()));
}

} // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
    const char* name = std::getenv("TROCAR_FUZZ_TARGET");
    const auto all = trocar::fuzz::targets();
    const auto found = std::find_if(all.begin(), all.end(), [&](const auto& target) { return name != nullptr && target.name == name; });
    if (found == all.end()) {
        std::fprintf(stderr, "TROCAR_FUZZ_TARGET must be one of:");
        for (const auto& target : all) std::fprintf(stderr, " %s", std::string(target.name).c_str());
        std::fprintf(stderr, "\n");
        std::exit(2);
    }
    chosen = &*found;
    if (const char* folder = std::getenv("TROCAR_FUZZ_SEEDS")) write_seeds(folder);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
    chosen->run({reinterpret_cast<const char*>(data), size});
    return 0;
}
