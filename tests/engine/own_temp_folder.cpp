// What the tests of this program write goes into a folder of its own, which goes away with it.
#include "tests/temp_folder.hpp"

#include <memory>

namespace trocar {
namespace {

class OwnTempFolder : public ::testing::Environment {
public:
    void SetUp() override {
        if (std::getenv("TEST_TMPDIR") != nullptr) return; // asked for, or that of the program whose death test this is
        folder_ = std::make_unique<TempFolder>();
        setenv("TEST_TMPDIR", folder_->path().c_str(), 1); // what testing::TempDir() answers
    }
    void TearDown() override {
        if (folder_) unsetenv("TEST_TMPDIR");
        folder_.reset();
    }

private:
    std::unique_ptr<TempFolder> folder_;
};

[[maybe_unused]] const ::testing::Environment* const kOwnFolder = ::testing::AddGlobalTestEnvironment(new OwnTempFolder);

} // namespace
} // namespace trocar
