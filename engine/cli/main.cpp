#include "engine/cli/commands.hpp"
#include "engine/report/build_facts.hpp"

extern const char* const kTrocarCommit; // cmake/commit.cmake writes it

int main(int argc, char** argv) {
    trocar::engine::name_commit(kTrocarCommit);
    return trocar::engine::run_program(argc, argv);
}
