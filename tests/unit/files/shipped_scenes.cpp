#include "engine/scene/scene.hpp"
#include "tests/support/catch.hpp"

#include <filesystem>

using namespace cairn;

TEST_CASE("every shipped scene is without mistakes and named as its file") {
    std::size_t count = 0;
    for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(CAIRN_SCENES)) {
        if (entry.path().extension() != ".json") continue;
        CAPTURE(entry.path().string());
        CHECK(load_scene(entry.path().string()).name == entry.path().stem().string());
        CHECK(std::filesystem::file_size(entry.path()) < 300'000);
        ++count;
    }
    CHECK(count >= 25);
}
