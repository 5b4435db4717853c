#include "tests/cli/program.hpp"
#include "tests/support/catch.hpp"

#include <sys/stat.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <vector>

namespace {

const char* kBall =
    R"({"format": "scene/1", "name": "drop", "duration": 1, "sample_interval": 0.25, "bodies": [
        {"name": "ground", "type": "static", "position": [0, 0, -9], "shapes": [{"type": "plane", "normal": [0, 0, 1], "offset": 0}]},
        {"name": "ball", "type": "dynamic", "mass": 1, "position": [1, 2, 3], "shapes": [{"type": "sphere", "radius": 0.5}]},
        {"name": "arm", "type": "kinematic", "position": [9, 0, 0], "shapes": []}]})";

std::string with_ball_key(const std::string& key) {
    std::string text = kBall;
    return text.replace(text.find("\"mass\""), 0, key + ", ");
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

struct SceneFile {
    TemporaryFolder folder;
    std::string path = folder.file("scene.json");
    explicit SceneFile(const std::string& text) { write_text(path, text); }
};

}  // namespace

TEST_CASE("run --json ends with one line that says what was run") {
    const SceneFile scene(kBall);
    const ProgramResult r = run_cairn("run " + scene.path + " --json --dt 1/40 --substeps 2 --iterations 3 --sleep 1 --stabilisation none");
    CAPTURE(r.out, r.err);
    REQUIRE(r.exit_code == 0);
    const nlohmann::json line = nlohmann::json::parse(r.last_line());
    CHECK(line.at("engine") == "cairn");
    CHECK(line.at("version").is_string());
    CHECK(line.at("precision") == 64);
    CHECK(line.at("scene") == "drop");
    CHECK(line.at("dt") == 0.025);
    CHECK(line.at("substeps") == 2);
    CHECK(line.at("iterations") == 3);
    CHECK(line.at("threads") == 1);
    CHECK(line.at("sleep") == 1);
    CHECK(line.at("steps") == 40);
    CHECK(line.at("wall_total_s") > 0);
    CHECK(line.at("wall_median_step_s") > 0);
    CHECK(line.at("wall_max_step_s") >= line.at("wall_median_step_s"));
    CHECK(line.at("unsupported") == nlohmann::json::array());
    CHECK(line.at("notes").is_array());
    CHECK(line.at("settings").at("solver") == "auto");
    CHECK(line.at("settings").at("stabilisation") == "none");
}

TEST_CASE("run --profile tells where the time went, and only then") {
    const SceneFile scene(kBall);
    const ProgramResult r = run_cairn("run " + scene.path + " --json --profile");
    REQUIRE(r.exit_code == 0);
    const nlohmann::json line = nlohmann::json::parse(r.last_line()), profile = line.at("profile");
    double total = 0;
    for (const auto& [stage, seconds] : profile.at("seconds").items()) {
        CHECK(seconds >= 0);
        total += seconds.get<double>();
    }
    CHECK(profile.at("seconds").at("broad_phase") > 0);
    CHECK(total == Approx(line.at("wall_total_s").get<double>()).epsilon(1e-9));
    CHECK(profile.at("counts").at("free_bodies") == 60);  // one ball, which falls 5 m in its second
    CHECK(profile.at("counts").at("allocations") > 0);    // the first steps grow their lists
    CHECK(profile.at("pair_types").is_object());

    const ProgramResult table = run_cairn("run " + scene.path + " --profile");
    REQUIRE(table.exit_code == 0);
    CHECK(table.out.find("broad phase") != std::string::npos);
    CHECK(table.out.find("free bodies") != std::string::npos);
    CHECK(run_cairn("run " + scene.path + " --json").out.find("\"profile\"") == std::string::npos);
}

TEST_CASE("run without an option uses the step's default of a sixtieth of a second") {
    const SceneFile scene(kBall);
    const ProgramResult r = run_cairn("run " + scene.path + " --json");
    REQUIRE(r.exit_code == 0);
    const nlohmann::json line = nlohmann::json::parse(r.last_line());
    CHECK(line.at("dt") == 1.0 / 60);
    CHECK(line.at("steps") == 60);
}

TEST_CASE("the states file has a row for each moving body and sample, stamped with the step's own time") {
    const SceneFile scene(kBall);
    // Steps of 0.07 s: 14 of them; multiples of 0.25 s are nearest to steps 4, 7 and 11, and the last step is a sample always.
    const std::string states = scene.folder.file("states.csv");
    const ProgramResult r = run_cairn("run " + scene.path + " --quiet --dt 0.07 --states " + states);
    CAPTURE(r.err);
    REQUIRE(r.exit_code == 0);
    CHECK(r.out.empty());
    const std::vector<std::string> lines = lines_of(read_text(states));
    REQUIRE(lines.size() == 1 + 2 * 5);
    CHECK(lines[0] == "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz");
    CHECK(lines[1] == "0,ball,1,2,3,1,0,0,0,0,0,0,0,0,0");
    CHECK(lines[2].rfind("0,arm,9,0,0,1,0,0,0,", 0) == 0);
    const int steps[] = {0, 4, 7, 11, 14};
    for (std::size_t k = 0; k < 5; ++k) {
        CAPTURE(lines[1 + 2 * k]);
        CHECK(std::stod(lines[1 + 2 * k]) == steps[k] * 0.07);
        CHECK(std::count(lines[1 + 2 * k].begin(), lines[1 + 2 * k].end(), ',') == 14);
    }
    // Nothing else is left in the folder.
    CHECK(std::distance(std::filesystem::directory_iterator(scene.folder.path()), {}) == 2);
}

TEST_CASE("a sample interval shorter than the step gives a sample after every step, and a run has at least one step") {
    const SceneFile scene(kBall);
    const std::string states = scene.folder.file("states.csv");
    REQUIRE(run_cairn("run " + scene.path + " --quiet --dt 0.5 --states " + states).exit_code == 0);
    CHECK(lines_of(read_text(states)).size() == 1 + 2 * 3);
    REQUIRE(run_cairn("run " + scene.path + " --quiet --dt 10 --states " + states).exit_code == 0);
    CHECK(lines_of(read_text(states)).size() == 1 + 2 * 2);
}

TEST_CASE("two runs of a scene write the same bytes") {
    const TemporaryFolder folder;
    REQUIRE(run_cairn("run pile_100 --quiet --states " + folder.file("a.csv")).exit_code == 0);
    REQUIRE(run_cairn("run pile_100 --quiet --states " + folder.file("b.csv")).exit_code == 0);
    CHECK(read_text(folder.file("a.csv")).size() > 10'000);
    CHECK((read_text(folder.file("a.csv")) == read_text(folder.file("b.csv"))));
}

TEST_CASE("a scene runs by its shipped name, and the summary is for people") {
    const ProgramResult r = run_cairn("run slide_stop");
    CAPTURE(r.out, r.err);
    CHECK(r.exit_code == 0);
    for (const char* part :
         {"slide_stop: 2 bodies", "steps", "time per step", "real-time factor", "contacts", "worst penetration", "energy", "asleep"}) {
        CAPTURE(part);
        CHECK(r.out.find(part) != std::string::npos);
    }
    CHECK(r.err.empty());
}

TEST_CASE("CAIRN_SCENES names another folder of scenes") {
    const SceneFile scene(kBall);
    CHECK(run_cairn("run scene --quiet", "CAIRN_SCENES=" + scene.folder.path()).exit_code == 0);
    const ProgramResult gone = run_cairn("list", "CAIRN_SCENES=/no/such/folder");
    CHECK(gone.exit_code == 2);
    CHECK(gone.err.find("CAIRN_SCENES: /no/such/folder, must be a folder of scene files") != std::string::npos);
}

TEST_CASE("a wrong scene file exits with 2, says where, and writes nothing") {
    const SceneFile scene(with_ball_key(R"("friction": -1, "colour": "red")"));
    const std::string states = scene.folder.file("states.csv");
    const ProgramResult r = run_cairn("run " + scene.path + " --json --states " + states);
    CAPTURE(r.err);
    CHECK(r.exit_code == 2);
    CHECK(r.out.empty());
    CHECK(r.err.find(scene.path + ": bodies[1].friction: -1, must be >= 0\n") != std::string::npos);
    CHECK(r.err.find(scene.path + ": bodies[1].colour: unknown key") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(states));
}

TEST_CASE("bad arguments exit with 2 and name the option, the value and what would be valid") {
    const SceneFile scene(kBall);
    struct Case {
        std::string arguments;
        std::string message;
    };
    const Case cases[] = {
        {"run /no/such/scene.json", "/no/such/scene.json: cannot be read: No such file or directory"},
        {"run no_such_scene", "scene: no_such_scene, must be a file or the name of a shipped scene (bounce, "},
        {"run " + scene.path + " --dt 0", "--dt: 0, must be a number of seconds > 0 or a fraction such as 1/240"},
        {"run " + scene.path + " --dt -1/60", "--dt: -1/60, must be"},
        {"run " + scene.path + " --dt 1/0", "--dt: 1/0, must be"},
        {"run " + scene.path + " --dt nan", "--dt: nan, must be"},
        {"run " + scene.path + " --dt 1/60s", "--dt: 1/60s, must be"},
        {"run " + scene.path + " --dt 1e-12", "--dt: 1e-12, must be at least a hundred-millionth of the scene's duration"},
        {"run " + scene.path + " --substeps 0", "--substeps: 0, must be a whole number >= 1"},
        {"run " + scene.path + " --iterations -3", "--iterations: -3, must be a whole number >= 1"},
        {"run " + scene.path + " --threads 0", "--threads: 0, must be a whole number >= 1"},
        {"run " + scene.path + " --sleep 2", "--sleep: 2, must be 0 or 1"},
        {"run " + scene.path + " --solver magic", "--solver: magic, must be one of auto, si, direct, rattle, mixed, tgs"},
        {"run " + scene.path + " --stabilisation glue", "--stabilisation: glue, must be one of split, target-velocity, none, soft"},
        {"run " + scene.path + " --tolerance -1", "--tolerance: -1, must be >= 0"},
        {"run " + scene.path + " --tolerance nan", "--tolerance: nan, must be >= 0"},
        {"run " + scene.path + " --residual-tolerance -1", "--residual-tolerance: -1, must be >= 0"},
        {"run " + scene.path + " --states /no/such/folder/s.csv",
         "--states: /no/such/folder/s.csv: cannot be opened for writing: No such file or directory"},
        {"run " + scene.path + " --states " + scene.folder.path(), "is a folder, must be a file"},
        {"run " + scene.path + " --no-such-option", "--no-such-option"},
        {"run", "SCENE is required"},
        {"", "subcommand"},
        {"fly", "fly: unknown command, known are run, list, scenes, bench, stress, diagnose, report, study"},
    };
    for (const Case& c : cases) {
        const ProgramResult r = run_cairn(c.arguments);
        CAPTURE(c.arguments, r.err);
        CHECK(r.exit_code == 2);
        CHECK((r.err + r.out).find(c.message) != std::string::npos);
    }
}

TEST_CASE("a full disk is told, not passed over") {
    if (!std::filesystem::exists("/dev/full")) return;
    const SceneFile scene(kBall);
    const ProgramResult r = run_cairn("run " + scene.path + " --quiet --states /dev/full");
    CHECK(r.exit_code == 2);
    CHECK(r.err.find("--states: /dev/full: cannot be written: No space left on device") != std::string::npos);
    CHECK(std::filesystem::is_character_file("/dev/full"));  // still the device
}

TEST_CASE("states go through a named pipe, which stays one") {
    const SceneFile scene(kBall);
    const std::string pipe = scene.folder.file("pipe"), read = scene.folder.file("read");
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    REQUIRE(std::system(("timeout 60 cat \"" + pipe + "\" >\"" + read + "\" &").c_str()) == 0);
    REQUIRE(run_cairn("run " + scene.path + " --quiet --states " + pipe).exit_code == 0);
    CHECK(std::filesystem::is_fifo(pipe));
    // The reader ends when the writer has; it may need a moment for its last bytes.
    for (int k = 0; k < 1000 && lines_of(read_text(read)).size() < 11; ++k) ::usleep(10'000);
    CHECK(lines_of(read_text(read)).size() == 1 + 2 * 5);
    CHECK(std::distance(std::filesystem::directory_iterator(scene.folder.path()), {}) == 3);  // no part of a file
}

TEST_CASE("states go to standard output, whether that is a pipe or a file, and the runner line comes after them") {
    const SceneFile scene(kBall);
    for (const char* path : {"/dev/stdout", "/dev/fd/1"}) {
        CAPTURE(path);
        const ProgramResult to_file = run_cairn("run " + scene.path + " --json --states " + path);
        const ProgramResult to_pipe = run_cairn("run " + scene.path + " --json --states " + path + " | cat");
        for (const ProgramResult& r : {to_file, to_pipe}) {
            CHECK(r.exit_code == 0);
            const std::vector<std::string> lines = lines_of(r.out);
            REQUIRE(lines.size() == 1 + 2 * 5 + 1);
            CHECK(lines.front() == "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz");
            CHECK(nlohmann::json::parse(lines.back()).at("scene") == "drop");
        }
    }
    CHECK(run_cairn("run " + scene.path + " --quiet --states /dev/fd/77").exit_code == 2);
}

TEST_CASE("a symbolic link for the states stays a link, and what it names is written") {
    const SceneFile scene(kBall);
    const std::string real = scene.folder.file("real.csv"), link = scene.folder.file("link.csv");
    write_text(real, "old");
    std::filesystem::create_symlink(real, link);
    REQUIRE(run_cairn("run " + scene.path + " --quiet --states " + link).exit_code == 0);
    CHECK(std::filesystem::is_symlink(link));
    CHECK(lines_of(read_text(real)).size() == 1 + 2 * 5);
}

TEST_CASE("a scene with torsional and rolling friction runs") {
    for (const char* key : {"torsional_friction", "rolling_friction"}) {
        const SceneFile scene(with_ball_key("\"" + std::string(key) + "\": 0.01"));
        const ProgramResult r = run_cairn("run " + scene.path + " --json");
        CAPTURE(key, r.out, r.err);
        CHECK(r.exit_code == 0);
        CHECK(nlohmann::json::parse(r.last_line()).at("unsupported") == nlohmann::json::array());
    }
}

TEST_CASE("an empty scene runs and its states are the header alone") {
    const SceneFile scene(R"({"format": "scene/1", "name": "nothing", "duration": 1, "sample_interval": 0.5, "bodies": []})");
    const std::string states = scene.folder.file("states.csv");
    REQUIRE(run_cairn("run " + scene.path + " --json --states " + states).exit_code == 0);
    CHECK(lines_of(read_text(states)).size() == 1);
}
