#include "engine/cli/commands.hpp"

int main(int argc, char** argv) { return seldinger::engine::run_program(argc, argv); }
