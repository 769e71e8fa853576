// Sweeps on disks that fill up, and under limits of the system: what could not be written is missing, and no result.
#include "sweep_command.hpp"

#include <csignal>
#include <sys/mount.h>
#include <sys/resource.h>

namespace trocar::cli_test {
namespace {

/// A disk of some KB in memory, as long as it lives.
class SmallDisk {
public:
    SmallDisk(const fs::path& place, int kb) : place_(place) {
        fs::create_directories(place);
        mounted_ = ::mount("none", place.c_str(), "tmpfs", 0, ("size=" + std::to_string(kb) + "k").c_str()) == 0;
    }
    ~SmallDisk() {
        if (mounted_) ::umount2(place_.c_str(), MNT_DETACH);
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;
    [[nodiscard]] bool mounted() const noexcept { return mounted_; }
    bool grow() const { return ::mount("none", place_.c_str(), "tmpfs", MS_REMOUNT, "size=100m") == 0; }

private:
    fs::path place_;
    bool mounted_ = false;
};

/// Files of this process and its children cannot become longer.
class FileLimit {
public:
    explicit FileLimit(rlim_t bytes) : before_(std::signal(SIGXFSZ, SIG_IGN)) {
        getrlimit(RLIMIT_FSIZE, &limit_);
        const rlimit low{bytes, limit_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &low);
    }
    ~FileLimit() {
        setrlimit(RLIMIT_FSIZE, &limit_);
        std::signal(SIGXFSZ, before_);
    }
    FileLimit(const FileLimit&) = delete;
    FileLimit& operator=(const FileLimit&) = delete;

private:
    rlimit limit_{};
    void (*before_)(int);
};

class FailingSweep : public SweepCommand {
protected:
    /// Everything is missing or done; with room, --resume comes to the table of an undisturbed sweep.
    void expect_resumed(const std::string& out, const std::string& table) const {
        EXPECT_TRUE(sweep_into(out, {"--status"}).says(", 0 failed, 0 running, ")) << "what could not be written is no failure of a run";
        ASSERT_TRUE(ended_with(sweep_into(out, {"--resume", "--collect", (folder / "resumed.csv").string()}), 0));
        EXPECT_EQ(text_of(folder / "resumed.csv"), table);
        for (const auto& entry : fs::recursive_directory_iterator(folder / out)) EXPECT_NE(entry.path().extension(), ".part") << entry.path();
    }
};

TEST_F(FailingSweep, AFullDiskLosesNoResultAndMakesNone) {
    for (const auto& [keep, kb] : {std::pair{"summary", 28}, {"summary", 52}, {"folder", 300}}) { // less than they take
        SCOPED_TRACE(keep + std::string(", KB: ") + std::to_string(kb));
        write_sweep(with(kSweep, R"("repeat": 2)", R"("repeat": 2, "keep": ")" + std::string(keep) + "\""));
        const std::string table = table_of("whole-" + std::to_string(kb));
        const SmallDisk disk(folder / "disk", kb);
        if (!disk.mounted()) GTEST_SKIP() << "this user may not mount";
        EXPECT_TRUE(refuses(sweep_into("disk/a", {"--jobs", "2"}), "No space left on device"));
        ASSERT_TRUE(disk.grow());
        expect_resumed("disk/a", table);
    }
}

TEST_F(FailingSweep, ALimitOfFilesIsNoResultOfARun) {
    write_sweep();
    const std::string table = table_of("whole");
    {
        const FileLimit limit(3500); // more than the plan's bytes, less than those of a run's figures
        const Ended ended = sweep_into("a", {"--jobs", "2"});
        EXPECT_TRUE(refuses(ended, "File too large")) << ended;
    }
    expect_resumed("a", table);
}

} // namespace
} // namespace trocar::cli_test
