// What the tests of this program write goes into a folder of its own, which goes away with it.
#include "tests/temp_folder.hpp"

#include <memory>

namespace trocar {
namespace {

class OwnTempFolder : public ::testing::Environment {
public:
    void SetUp() override {
        folder_ = std::make_unique<TempFolder>();
        setenv("TEST_TMPDIR", folder_->path().c_str(), 1); // what testing::TempDir() answers
    }
    void TearDown() override {
        unsetenv("TEST_TMPDIR");
        folder_.reset();
    }

private:
    std::unique_ptr<TempFolder> folder_;
};

[[maybe_unused]] const ::testing::Environment* const kOwnFolder = ::testing::AddGlobalTestEnvironment(new OwnTempFolder);

} // namespace
} // namespace trocar
