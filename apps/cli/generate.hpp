// Scenes made by rule: the large ones, which are not worth a file each.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cairn::cli {

class Random;
class SceneWriter;

struct Generator {
    const char* kind;
    int default_count;
    int most;  // larger counts are refused: the file would not fit into memory or sense
    const char* description;
    double duration;         // [s]
    double sample_interval;  // [s]
    void (*fill)(SceneWriter& scene, int count, Random& random);
};

const std::vector<Generator>& generators();

// The generator of this kind. Throws Error that lists the kinds if there is none.
const Generator& generator(const std::string& kind);

struct GeneratedScene {
    std::string name;  // KIND_COUNT
    std::string text;  // a scene file
};
// The same kind, count and seed give the same text on every machine. Throws Error if the count is out of range.
GeneratedScene generate_scene(const Generator& generator, int count, std::uint64_t seed);

}  // namespace cairn::cli
