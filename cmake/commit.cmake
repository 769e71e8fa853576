# Writes OUTPUT, which defines kTrocarCommit: the commit that SOURCE is at, empty where that is no checkout.
execute_process(COMMAND git rev-parse --short=12 HEAD WORKING_DIRECTORY ${SOURCE}
    OUTPUT_VARIABLE commit ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed)
if(failed)
    set(commit "")
endif()
file(WRITE ${OUTPUT} "extern const char* const kTrocarCommit;\nconst char* const kTrocarCommit = \"${commit}\";\n")
