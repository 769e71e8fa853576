// What `sweep` makes of the answers of Slurm's programs.
#include "sweep_command.hpp"

#include <cstdlib>

namespace trocar::cli_test {
namespace {

/// Programs of Slurm that answer what a test says, first on the PATH.
class SlurmSweep : public SweepCommand {
protected:
    SlurmSweep() : path_(std::getenv("PATH")) {
        tool("sbatch", "if [ -e $0.used ]; then echo 102; else echo 101; touch $0.used; fi");
        tool("scontrol", "seq -f 'Line %g of a long answer' 400; echo 'MaxArraySize = 13'; seq 400");
        tool("squeue", "exit 0");
        tool("sacct", "echo 'sacct: error: Slurm accounting storage is disabled' >&2; exit 1");
        setenv("PATH", ((folder / "bin").string() + ":" + path_).c_str(), 1);
        write_sweep();
    }
    ~SlurmSweep() override { setenv("PATH", path_.c_str(), 1); }
    SlurmSweep(const SlurmSweep&) = delete;
    SlurmSweep& operator=(const SlurmSweep&) = delete;

    void tool(const std::string& name, const std::string& script) const {
        fs::create_directories(folder / "bin");
        write("bin/" + name, "#!/bin/sh\n" + script + "\n");
        fs::permissions(folder / "bin" / name, fs::perms::owner_all);
    }
    void submit() const { ASSERT_TRUE(ended_with(sweep_into("a", {"--slurm", "--no-forecast"}), 0)); }
    /// Chunks 0 to 11, one for each task from 1.
    void submit_single_chunks() const {
        submit();
        std::string lines;
        for (int chunk = 0; chunk < 12; ++chunk) lines += std::to_string(chunk) + "\n";
        write("a/slurm/1-tasks", lines);
    }

private:
    std::string path_;
};

TEST_F(SlurmSweep, TheStatusTellsHowSlurmEndedTasks) {
    submit_single_chunks();
    ASSERT_TRUE(ended_with(call({"sweep-worker", (folder / "a").string(), "--chunk", "0"}), 0));
    tool("squeue", "echo '1 COMPLETED'; echo '2 RUNNING'; echo '3 TIMEOUT'; echo '4 OUT_OF_MEMORY'; echo '12 PENDING'");
    tool("sacct", "echo '102_5|NODE_FAIL'; echo '102_6|PREEMPTED'; echo '102_7|CANCELLED by 1000'; echo '102_8|FAILED'; echo '102_9|TIMEOUT'; echo '102_2|FAILED'");
    const Ended status = sweep_into("a", {"--status"});
    EXPECT_TRUE(ended_with(status, 0));
    for (const char* piece : {"slurm    1 tasks running, 1 waiting", "chunks 2, 8: TIMEOUT: beyond the time limit", "chunk 3: OUT_OF_MEMORY", "chunk 4: NODE_FAIL",
                              "chunk 5: PREEMPTED", "chunk 6: CANCELLED: cancelled", "chunk 7: FAILED", "chunks 9, 10: not in the queue", "sacct has no record of them"})
        EXPECT_TRUE(status.says(piece)) << piece << "\n" << status;
    EXPECT_FALSE(status.says("COMPLETED")) << "its chunk has its results: " << status;
}

TEST_F(SlurmSweep, WithoutAccountingWhatIsNotKnownIsSaid) {
    submit_single_chunks();
    tool("squeue", "echo 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1");
    const Ended status = sweep_into("a", {"--status"});
    EXPECT_TRUE(status.says("chunks 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11: not in the queue, and how their tasks ended is not known: sacct failed: sacct: error: "
                            "Slurm accounting storage is disabled"))
        << status;
    tool("squeue", "echo 'Unable to contact slurm controller' >&2; exit 1");
    EXPECT_TRUE(sweep_into("a", {"--status"}).says("cannot be asked: squeue failed: Unable to contact"));
}

TEST_F(SlurmSweep, ALaterTaskIsWhatCountsForAChunk) {
    submit_single_chunks();
    tool("squeue", "case \"$*\" in *102*) for task in $(seq 12); do echo \"$task TIMEOUT\"; done;; esac");
    EXPECT_TRUE(sweep_into("a", {"--status"}).says("TIMEOUT"));
    write("a/slurm/2-tasks", "0,1,2,3,4,5,6,7,8,9,10\n11\n");
    write("a/slurm/2-job", "103\n");
    tool("squeue", "case \"$*\" in *102*) for task in $(seq 12); do echo \"$task TIMEOUT\"; done;; *103*) echo '1 RUNNING'; echo '2 OUT_OF_MEMORY';; esac");
    const Ended status = sweep_into("a", {"--status"});
    EXPECT_FALSE(status.says("TIMEOUT")) << status;
    EXPECT_TRUE(status.says("chunk 11: OUT_OF_MEMORY: more memory than was asked for")) << status;
    EXPECT_TRUE(sweep_into("a", {"--resume", "--slurm", "--no-forecast", "--memory", "4000"}).says("1 chunks after the preparation"));
    EXPECT_NE(text_of(folder / "a" / "slurm" / "3-array.sh").find("--mem=4000M"), std::string::npos);
}

TEST_F(SlurmSweep, TasksThatSlurmHoldsAreSaidToNeedARelease) {
    submit_single_chunks();
    tool("squeue", "echo '1 PENDING launch failed requeued held'; echo '2 PENDING JobHeldUser'; echo '3 REQUEUE_HOLD'; echo '4 PENDING Resources'; echo '5 RUNNING None'");
    const char* said = "1 tasks running, 4 waiting; those that Slurm holds go on after `scontrol release 102`";
    EXPECT_TRUE(sweep_into("a", {"--status"}).says(said));
    tool("squeue", "for task in $(seq 12); do echo \"$task PENDING JobHeldAdmin\"; done");
    EXPECT_TRUE(sweep_into("a", {"--resume", "--slurm", "--no-forecast"}).says("nothing to submit: 0 tasks running, 12 waiting; those that Slurm holds"));
}

TEST_F(SlurmSweep, ALongQueueIsReadToItsEnd) {
    submit_single_chunks();
    std::string tasks;
    for (int task = 1; task <= 3000; ++task) tasks += std::to_string(task - 1) + "\n"; // what is beyond the plan has no chunk
    write("a/slurm/1-tasks", tasks);
    tool("squeue", "for task in $(seq 3000); do echo \"$task PENDING\"; done");
    const Ended status = sweep_into("a", {"--status"});
    EXPECT_TRUE(status.says("0 tasks running, 3000 waiting")) << status;
    EXPECT_TRUE(sweep_into("a", {"--resume", "--slurm", "--no-forecast"}).says("nothing to submit")) << "chunk 0 is named first";
}

} // namespace
} // namespace trocar::cli_test
