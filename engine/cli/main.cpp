#include "engine/cli/commands.hpp"

int main(int argc, char** argv) { return trocar::engine::run_program(argc, argv); }
