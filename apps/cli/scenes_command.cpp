#include "apps/cli/commands.hpp"
#include "apps/cli/generate.hpp"

#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

namespace cairn::cli {

namespace {

struct Arguments {
    std::vector<std::string> names;
    std::string out;
    std::optional<int> count;
    std::uint64_t seed = 1;
};

struct Wanted {
    const Generator* generator;
    int count;
};

// KIND or KIND_COUNT.
Wanted parse_name(const std::string& name, const std::optional<int>& count) {
    const std::size_t underscore = name.rfind('_');
    int number = 0;
    if (underscore != std::string::npos) {
        const char* end = name.data() + name.size();
        const std::from_chars_result read = std::from_chars(name.data() + underscore + 1, end, number);
        if (read.ec == std::errc() && read.ptr == end) return {&generator(name.substr(0, underscore)), number};
    }
    const Generator& g = generator(name);
    return {&g, count.value_or(g.default_count)};
}

void write_file(const std::filesystem::path& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw Error(path.string() + ": cannot be written: " + std::strerror(errno));
}

int write_scenes(const Arguments& arguments) {
    std::vector<Wanted> wanted;
    for (const std::string& name : arguments.names) wanted.push_back(parse_name(name, arguments.count));
    if (arguments.names.empty()) {
        for (const Generator& g : generators()) wanted.push_back({&g, arguments.count.value_or(g.default_count)});
    }
    std::error_code error;
    std::filesystem::create_directories(arguments.out, error);
    if (!std::filesystem::is_directory(arguments.out))
        throw Error("--out: " + arguments.out + ": cannot be made a folder: " + error.message());
    for (const Wanted& w : wanted) {
        const GeneratedScene scene = generate_scene(*w.generator, w.count, arguments.seed);
        const std::filesystem::path path = std::filesystem::path(arguments.out) / (scene.name + ".json");
        write_file(path, scene.text);
        fmt::print("{}\n", path.string());
    }
    return kSuccess;
}

}  // namespace

void add_scenes_command(CLI::App& app, int& exit_code) {
    CLI::App* command = app.add_subcommand("scenes", "Write scenes of any size to files");
    const std::shared_ptr<Arguments> arguments = std::make_shared<Arguments>();
    command->add_option("NAME", arguments->names, "Kinds, or KIND_COUNT; without any, one of each kind");
    command->add_option("--out", arguments->out, "Folder to write to; made if it is not there")->required();
    command->add_option("--count", arguments->count, "How many, for names without a count of their own");
    command->add_option("--seed", arguments->seed, "Another seed gives other random numbers")->capture_default_str();
    std::string kinds = "Kinds:\n";
    for (const Generator& g : generators()) kinds += fmt::format("  {:<9} {} (default count {})\n", g.kind, g.description, g.default_count);
    command->footer(kinds +
                    "Examples:\n"
                    "  cairn scenes --out my_scenes\n"
                    "  cairn scenes pyramid --count 40 --out my_scenes\n"
                    "  cairn scenes pile_500 chain_100 --seed 7 --out my_scenes");
    command->callback([arguments, &exit_code] { exit_code = write_scenes(*arguments); });
}

}  // namespace cairn::cli
