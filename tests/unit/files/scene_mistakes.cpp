// What a wrong file is told: each mistake with its place, in one line, and all of them in one go.
#include "tests/support/catch.hpp"
#include "tests/unit/files/scene_text.hpp"

#include <algorithm>
#include <vector>

using namespace cairn;
using namespace scene_text;

namespace {

struct Case {
    std::string text;
    std::string message;  // without "file: "
};

void check_each(const std::vector<Case>& cases) {
    for (const Case& c : cases) {
        CAPTURE(c.text);
        CHECK(mistakes(c.text) == "file: " + c.message);
    }
}

std::string head(const std::string& keys) {
    return "{" + keys + R"("bodies": []})";
}

std::string join(const std::string& joint) {
    return scene(ball("a") + "," + ball("b"), joint);
}

}  // namespace

TEST_CASE("a mistake in the head of a scene is told with its key") {
    const std::string f = R"("format": "scene/1", )", n = R"("name": "s", )", d = R"("duration": 1, )", i = R"("sample_interval": 1, )";
    check_each({
        {head(n + d + i), "format: missing, must be a text"},
        {head(R"("format": "scene/2", )" + n + d + i), "format: \"scene/2\", must be \"scene/1\""},
        {head(R"("format": 1, )" + n + d + i), "format: 1, must be a text"},
        {head(f + d + i), "name: missing, must be a text"},
        {head(f + R"("name": "", )" + d + i), "name: \"\", must not be empty"},
        {head(f + n + i), "duration: missing, must be a number > 0"},
        {head(f + n + R"("duration": 0, )" + i), "duration: 0, must be > 0"},
        {head(f + n + R"("duration": "long", )" + i), "duration: \"long\", must be a number"},
        {head(f + n + d), "sample_interval: missing, must be a number > 0"},
        {head(f + n + d + R"("sample_interval": -0.1, )"), "sample_interval: -0.1, must be > 0"},
        {head(f + n + d + i + R"("gravity": [0, 0], )"), "gravity: [0,0], must be a list of 3 numbers"},
        {head(f + n + d + i + R"("gravity": [0, null, 0], )"), "gravity[1]: null, must be a number"},
        {head(f + n + d + i + R"("gravty": [0, 0, 0], )"), "gravty: unknown key, did you mean \"gravity\"?"},
        {head(f + n + d + i + R"("author": "me", )"),
         "author: unknown key, known are format, name, description, gravity, duration, sample_interval, bodies, joints, checks"},
        {head(f + n + d + i + R"("checks": {}, )"), "checks: an object, must be a list of checks"},
        {head(f + n + d + i + R"("checks": [{"metric": "rest"}, {}], )"), "checks[1].metric: missing, must be a text"},
        {head(f + n + d + i + R"("checks": [3], )"), "checks[0]: 3, must be an object"},
        {head(f + n + d + i + d), "duration: given twice in one object"},
        {"{" + f + n + d + i + R"("joints": []})", "bodies: missing, must be a list of bodies"},
        {"[1, 2]", "[1,2], must be an object"},
    });
}

TEST_CASE("a mistake in a body is told with its place") {
    const std::string sphere = R"({"type": "sphere", "radius": 1})";
    check_each({
        {scene("7"), "bodies[0]: 7, must be an object"},
        {scene(ball("")), "bodies[0].name: \"\", must not be empty"},
        {scene(ball("a,b")), "bodies[0].name: \"a,b\", must be without commas, double quotes, line breaks and control characters"},
        {scene(ball("a\\nb")), "bodies[0].name: \"a\\nb\", must be without commas, double quotes, line breaks and control characters"},
        {scene(ball("a\\\"b")), "bodies[0].name: \"a\\\"b\", must be without commas, double quotes, line breaks and control characters"},
        {scene(ball("a") + "," + ball("b") + "," + ball("a")), "bodies[2].name: \"a\", must be used once: bodies[0] has it too"},
        {scene(R"({"name": "a", "type": "dynamik", "position": [0,0,0], "mass": 1, "shapes": []})"),
         "bodies[0].type: \"dynamik\", must be one of static, dynamic, kinematic"},
        {scene(R"({"name": "a", "position": [0,0,0], "shapes": []})"),
         "bodies[0].type: missing, must be one of static, dynamic, kinematic"},
        {scene(R"({"name": "a", "type": "static", "shapes": []})"), "bodies[0].position: missing, must be a list of 3 numbers"},
        {scene(R"({"name": "a", "type": "static", "position": [0,0,0]})"), "bodies[0].shapes: missing, must be a list of shapes"},
        {scene(R"({"name": "a", "type": "dynamic", "position": [0,0,0], "shapes": [)" + sphere + "]}"),
         "bodies[0].mass: missing, must be a number > 0"},
        {scene(R"({"name": "a", "type": "dynamic", "mass": 0, "position": [0,0,0], "shapes": [)" + sphere + "]}"),
         "bodies[0].mass: 0, must be > 0"},
        {scene(R"({"name": "a", "type": "dynamic", "mass": -1, "position": [0,0,0], "shapes": [)" + sphere + "]}"),
         "bodies[0].mass: -1, must be > 0"},
        {scene(fixed(sphere, R"("mass": 1)")), "bodies[0].mass: must not be given: only a dynamic body has one"},
        {scene(fixed(sphere, R"("inertia": [1,1,1])")), "bodies[0].inertia: must not be given: only a dynamic body has one"},
        {scene(fixed(sphere, R"("force": [1,1,1])")), "bodies[0].force: must not be given: only a dynamic body has one"},
        {scene(fixed(sphere, R"("linear_velocity": [1,0,0])")),
         "bodies[0].linear_velocity: [1.0,0.0,0.0], must be zero: a static body does not move"},
        {scene(fixed(sphere, R"("motion": {})")), "bodies[0].motion: must not be given: only a kinematic body has one"},
        {scene(ball("a", R"("rotation": [0, 0, 0, 0])")),
         "bodies[0].rotation: [0,0,0,0], must be a unit quaternion [w, x, y, z] (length 1 within 0.001)"},
        {scene(ball("a", R"("rotation": [1, 0.1, 0, 0])")),
         "bodies[0].rotation: [1,0.1,0,0], must be a unit quaternion [w, x, y, z] (length 1 within 0.001)"},
        {scene(ball("a", R"("rotation": [1, 0, 0])")), "bodies[0].rotation: [1,0,0], must be a list of 4 numbers"},
        {scene(ball("a", R"("friction": -0.1)")), "bodies[0].friction: -0.1, must be >= 0"},
        {scene(ball("a", R"("restitution": "high")")), "bodies[0].restitution: \"high\", must be a number"},
        {scene(ball("a", R"("restitution": -0.5)")), "bodies[0].restitution: -0.5, must be >= 0"},
        {scene(ball("a", R"("torsional_friction": -1)")), "bodies[0].torsional_friction: -1, must be >= 0"},
        {scene(ball("a", R"("rolling_friction": -1)")), "bodies[0].rolling_friction: -1, must be >= 0"},
        {scene(ball("a", R"("force": [1, 2])")), "bodies[0].force: [1,2], must be a list of 3 numbers"},
        {scene(ball("a", R"("inertia": [1, 0, 1])")), "bodies[0].inertia[1]: 0, must be > 0"},
        {scene(ball("a", R"("inertia": [1, 1, 2.1])")),
         "bodies[0].inertia: [1.0,1.0,2.1], must have no moment larger than the sum of the other two"},
        {scene(ball("a", R"("fricton": 0.1)")), "bodies[0].fricton: unknown key, did you mean \"friction\"?"},
        {scene(ball("a", R"("mass": 2)")), "bodies[0].mass: given twice in one object"},
        {scene(shaped("")), "bodies[0].inertia: missing, must be given for a dynamic body without shapes"},
        {scene(shaped(R"({"type": "sphere", "radius": 1, "position": [0.5, 0, 0]})")),
         "bodies[0].inertia: missing, must be given: the shapes' centroid [0.5,0.0,0.0] is not the body's origin"},
    });
}

TEST_CASE("a mistake in a motion is told with its place") {
    const auto kinematic = [](const std::string& motion) {
        return scene(R"({"name": "k", "type": "kinematic", "position": [0,0,0], "shapes": [], "motion": )" + motion + "}");
    };
    check_each({
        {kinematic("1"), "bodies[0].motion: 1, must be an object"},
        {kinematic(R"({"type": "spin", "axis": [0,0,1], "amplitude": 1, "period": 1})"),
         "bodies[0].motion.type: \"spin\", must be one of rotate_sine"},
        {kinematic(R"({"type": "rotate_sine", "axis": [0,0,0], "amplitude": 1, "period": 1})"),
         "bodies[0].motion.axis: [0,0,0], must not be zero"},
        {kinematic(R"({"type": "rotate_sine", "axis": [0,0,1], "period": 1})"), "bodies[0].motion.amplitude: missing, must be a number"},
        {kinematic(R"({"type": "rotate_sine", "axis": [0,0,1], "amplitude": 1, "period": 0})"), "bodies[0].motion.period: 0, must be > 0"},
        {scene(ball("a", R"("motion": {"type": "rotate_sine", "axis": [0,0,1], "amplitude": 1, "period": 1})")),
         "bodies[0].motion: must not be given: only a kinematic body has one"},
    });
}

TEST_CASE("a mistake in a shape is told with its place") {
    const std::string mesh = R"({"type": "mesh", "vertices": [[0,0,0],[1,0,0],[0,1,0]], "triangles": )";
    check_each({
        {scene(shaped(R"({"radius": 1})")),
         "bodies[0].shapes[0].type: missing, must be one of box, sphere, capsule, cylinder, convex, plane, mesh"},
        {scene(shaped(R"({"type": "ball"})")),
         "bodies[0].shapes[0].type: \"ball\", must be one of box, sphere, capsule, cylinder, convex, plane, mesh"},
        {scene(shaped(R"({"type": "sphere", "radius": -1})")), "bodies[0].shapes[0].radius: -1, must be > 0"},
        {scene(shaped(R"({"type": "sphere"})")), "bodies[0].shapes[0].radius: missing, must be a number > 0"},
        {scene(shaped(R"({"type": "sphere", "radius": 1, "half_height": 1})")),
         "bodies[0].shapes[0].half_height: unknown key, known are type, position, rotation, radius"},
        {scene(shaped(R"({"type": "box", "half_extents": [1, 0, 1]})")), "bodies[0].shapes[0].half_extents[1]: 0, must be > 0"},
        {scene(shaped(R"({"type": "box", "half_extents": 1})")), "bodies[0].shapes[0].half_extents: 1, must be a list of 3 numbers"},
        {scene(shaped(R"({"type": "box", "half_extent": [1, 1, 1], "half_extents": [1, 1, 1]})")),
         "bodies[0].shapes[0].half_extent: unknown key, did you mean \"half_extents\"?"},
        {scene(shaped(R"({"type": "capsule", "radius": 1, "half_height": 0})")), "bodies[0].shapes[0].half_height: 0, must be > 0"},
        {scene(shaped(R"({"type": "cylinder", "radius": 0, "half_height": 1})")), "bodies[0].shapes[0].radius: 0, must be > 0"},
        {scene(shaped(R"({"type": "sphere", "radius": 1, "position": [0, "up", 0]})")),
         "bodies[0].shapes[0].position[1]: \"up\", must be a number"},
        {scene(shaped(R"({"type": "convex", "points": [[0,0,0],[1,0,0],[0,1,0]]})")),
         "bodies[0].shapes[0].points: a list of 3, must be at least 4 points"},
        {scene(shaped(R"({"type": "convex", "points": [[0,0,0],[1,0,0],[0,1,0],[0,0]]})")),
         "bodies[0].shapes[0].points[3]: [0,0], must be a list of 3 numbers"},
        {scene(shaped(R"({"type": "plane", "normal": [0,0,1], "offset": 0})")), "bodies[0].shapes[0]: a plane, must be on a static body"},
        {scene(shaped(mesh + "[[0,1,2]]}")), "bodies[0].shapes[0]: a mesh, must be on a static body"},
        {scene(fixed(R"({"type": "plane", "normal": [0,0,2], "offset": 0})")),
         "bodies[0].shapes[0].normal: [0,0,2], must be a unit vector (length 1 within 0.001)"},
        {scene(fixed(R"({"type": "plane", "normal": [0,0,1]})")), "bodies[0].shapes[0].offset: missing, must be a number"},
        {scene(fixed(mesh + "[]}")), "bodies[0].shapes[0].triangles: a list of 0, must be at least 1 triangle"},
        {scene(fixed(mesh + "[[0,1,3]]}")), "bodies[0].shapes[0].triangles[0][2]: 3, must be a whole number from 0 to 2"},
        {scene(fixed(mesh + "[[0,1,2],[0,-1,2]]}")), "bodies[0].shapes[0].triangles[1][1]: -1, must be a whole number from 0 to 2"},
        {scene(fixed(mesh + "[[0,1.5,2]]}")), "bodies[0].shapes[0].triangles[0][1]: 1.5, must be a whole number from 0 to 2"},
        {scene(fixed(mesh + "[[0,1]]}")), "bodies[0].shapes[0].triangles[0]: [0,1], must be a list of 3 vertex numbers"},
        {scene(fixed(mesh + "[[0,1,1]]}")), "bodies[0].shapes[0].triangles[0]: [0,1,1], must be a triangle with an area"},
    });
}

TEST_CASE("hull points in one plane are told at the points") {
    const std::string said = mistakes(scene(shaped(R"({"type": "convex", "points": [[0,0,0],[1,0,0],[0,1,0],[1,1,0]]})")));
    CAPTURE(said);
    CHECK(said.rfind("file: bodies[0].shapes[0].points: must span a volume: ", 0) == 0);
    CHECK(said.find('\n') == std::string::npos);
}

TEST_CASE("a mistake in a joint is told with its place") {
    check_each({
        {join("null"), "joints[0]: null, must be an object"},
        {join(R"({"type": "glue", "body_a": "a", "body_b": "b", "anchor": [0,0,0]})"),
         "joints[0].type: \"glue\", must be one of ball, hinge, slider, fixed, distance"},
        {join(R"({"type": "ball", "body_a": "a", "body_b": "nobody", "anchor": [0,0,0]})"),
         "joints[0].body_b: \"nobody\", must be the name of a body, or null for the world"},
        {scene(ball("upper_arm") + "," + ball("b"), R"({"type": "ball", "body_a": "uper_arm", "body_b": "b", "anchor": [0,0,0]})"),
         "joints[0].body_a: \"uper_arm\", must be the name of a body, or null for the world; did you mean \"upper_arm\"?"},
        {join(R"({"type": "ball", "body_a": 1, "body_b": "b", "anchor": [0,0,0]})"),
         "joints[0].body_a: 1, must be the name of a body, or null for the world"},
        {join(R"({"type": "ball", "body_b": "b", "anchor": [0,0,0]})"),
         "joints[0].body_a: missing, must be the name of a body, or null for the world"},
        {join(R"({"type": "ball", "body_a": "a", "body_b": "a", "anchor": [0,0,0]})"),
         "joints[0]: body_a and body_b are both \"a\", must be two bodies"},
        {join(R"({"type": "ball", "body_a": null, "body_b": null, "anchor": [0,0,0]})"),
         "joints[0]: body_a and body_b are both the world, must be at least one body"},
        {scene(fixed(""), R"({"type": "ball", "body_a": "ground", "body_b": null, "anchor": [0,0,0]})"),
         "joints[0]: body_a and body_b, must be at least one dynamic body"},
        {join(R"({"type": "ball", "body_a": "a", "body_b": "b"})"), "joints[0].anchor: missing, must be a list of 3 numbers"},
        {join(R"({"type": "hinge", "body_a": "a", "body_b": "b", "anchor": [0,0,0]})"),
         "joints[0].axis: missing, must be a list of 3 numbers"},
        {join(R"({"type": "slider", "body_a": "a", "body_b": "b", "anchor": [0,0,0], "axis": [0,0,0]})"),
         "joints[0].axis: [0,0,0], must not be zero"},
        {join(R"({"type": "ball", "body_a": "a", "body_b": "b", "anchor": [0,0,0], "axis": [0,0,1]})"),
         "joints[0].axis: must not be given: only a hinge or a slider has one"},
        {join(R"({"type": "distance", "body_a": "a", "body_b": "b", "anchor_a": [1,1,1], "anchor_b": [1,1,1]})"),
         "joints[0]: anchor_a and anchor_b are the same point, must be apart"},
        {join(R"({"type": "distance", "body_a": "a", "body_b": "b", "anchor_a": [1,1,1]})"),
         "joints[0].anchor_b: missing, must be a list of 3 numbers"},
        {join(R"({"type": "distance", "body_a": "a", "body_b": "b", "anchor_a": [1,1,1], "anchor_b": [0,0,0], "anchor": [0,0,0]})"),
         "joints[0].anchor: must not be given: a distance joint has anchor_a and anchor_b instead"},
        {join(R"({"type": "ball", "body_a": "a", "body_b": null, "anchor": [1e308,0,0]})"),
         "joints[0].anchor: 1e+308 m from \"a\", must be at most 1e6 m"},
        {join(R"({"type": "distance", "body_a": "a", "body_b": null, "anchor_a": [0,0,0], "anchor_b": [0,1e200,0]})"),
         "joints[0]: anchor_a and anchor_b are 1e+200 m apart, must be at most 1e6 m"},
        {join(R"({"type": "fixed", "body_a": "a", "body_b": "b", "anchor": [0,0,0], "collide_connected": 1})"),
         "joints[0].collide_connected: 1, must be true or false"},
        {join(R"({"type": "fixed", "body_a": "a", "body_b": "b", "anchor": [0,0,0], "collide_conected": true})"),
         "joints[0].collide_conected: unknown key, did you mean \"collide_connected\"?"},
    });
}

TEST_CASE("a text that is no JSON is told with line and column") {
    check_each({
        {"", "is empty, must be a scene"},
        {" \n\t ", "is empty, must be a scene"},
        {"{\"format\": \"scene/1\",\n \"name\": \"s\",\n \"duration\": 1e999}", "line 3, column 18: 1e999, must be a finite number"},
    });
    const std::string whole = scene(ball("a"));
    // Cut anywhere, the file is refused at its end, and never read as if it were whole.
    for (std::size_t length = 1; length < whole.size(); ++length) {
        const std::string said = mistakes(whole.substr(0, length));
        CAPTURE(length, said);
        CHECK(said.rfind("file: line 1, column " + std::to_string(length + 1) + ": ", 0) == 0);
        CHECK(said.find('\n') == std::string::npos);
    }
    CHECK(mistakes("{\"mass\": NaN}").find("file: line 1, column 10: ") == 0);
    CHECK(mistakes("{\"mass\": NaN}").find("(a number must be finite)") != std::string::npos);
}

TEST_CASE("a file that is not there or is a folder says so") {
    CHECK_THROWS_WITH(load_scene("/no/such/file.json"), "/no/such/file.json: cannot be read: No such file or directory");
    CHECK_THROWS_WITH(load_scene("/"), "/: is a folder, must be a scene file");
}

TEST_CASE("all mistakes of a file are told in one go, one line each") {
    const std::string text = scene(ball("a", R"("friction": -1, "restitution": -2)") + "," +
                                       shaped(R"({"type": "sphere", "radius": -1}, {"type": "box"})", R"("colour": "red")"),
                                   R"({"type": "ball", "body_a": "a", "body_b": "c", "anchor": [0, 0]})");
    const std::string said = mistakes(text);
    CAPTURE(said);
    CHECK(std::count(said.begin(), said.end(), '\n') == 6);
    for (const char* line :
         {"file: bodies[0].friction: -1, must be >= 0\n", "file: bodies[0].restitution: -2, must be >= 0\n",
          "file: bodies[1].shapes[0].radius: -1, must be > 0\n",
          "file: bodies[1].shapes[1].half_extents: missing, must be a list of 3 numbers\n", "file: bodies[1].colour: unknown key, ",
          "file: joints[0].body_b: \"c\", must be ", "file: joints[0].anchor: [0,0], must be a list of 3 numbers"}) {
        CAPTURE(line);
        CHECK(said.find(line) != std::string::npos);
    }
}

TEST_CASE("a file with more mistakes than anyone reads ends with their number") {
    std::string bodies = ball("b0", R"("friction": -1)");
    for (int k = 1; k < 1500; ++k) bodies += "," + ball("b" + std::to_string(k), R"("friction": -1)");
    const std::string said = mistakes(scene(bodies));
    CHECK(std::count(said.begin(), said.end(), '\n') == 1000);
    CHECK(said.substr(said.rfind('\n') + 1) == "file: and 500 mistakes more");
}
