#include "tests/structure/source_tree.hpp"
#include "tests/support/catch.hpp"

namespace {

const SourceTree& sources() {
    static const SourceTree tree = read_source_tree(CAIRN_SOURCE);
    return tree;
}

std::string list(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + "\n";
    return text;
}

SourceTree tree_of(const std::vector<std::pair<std::string, std::string>>& files) {
    SourceTree tree;
    for (const auto& [path, text] : files) tree[path] = parse_source(path, text);
    return tree;
}

}  // namespace

TEST_CASE("the structure tests see the sources") {
    CHECK(sources().count("engine/base/math.hpp") == 1);
    CHECK(sources().at("engine/world.hpp").project_includes.size() >= 3);
    CHECK(sources().count("tests/structure/structure_test.cpp") == 1);
}

TEST_CASE("every quoted include names a file of the project from its root") {
    CHECK(list(missing_includes(sources())) == "");
}

TEST_CASE("includes follow base <- {collision, solver} <- engine <- apps") {
    CHECK(list(forbidden_includes(sources())) == "");
}

TEST_CASE("only collision/fcl_* sees FCL and libccd") {
    CHECK(list(fcl_leaks(sources())) == "");
}

TEST_CASE("no file includes itself, directly or through others") {
    CHECK(list(include_cycles(sources())) == "");
}

TEST_CASE("files stay short") {
    const std::vector<std::string> long_files = oversized_files(sources(), 400);
    if (!long_files.empty()) WARN("over 400 lines, time to split:\n" + list(long_files));
    CHECK(list(oversized_files(sources(), 450)) == "");
}

// The laws themselves, on made-up trees that break them.

TEST_CASE("a breach of each structure law is found") {
    SECTION("a room that includes upwards or sideways") {
        const SourceTree tree = tree_of({{"engine/base/a.hpp", "#include \"collision/b.hpp\"\n"},
                                         {"collision/b.hpp", "#include \"solver/c.hpp\"\n"},
                                         {"solver/c.hpp", "  #  include \"engine/d.hpp\"  // far up\n"},
                                         {"engine/d.hpp", "#include \"apps/cli/e.hpp\"\n"},
                                         {"apps/cli/e.hpp", "#include \"tests/support/f.hpp\"\n"},
                                         {"tests/support/f.hpp", "#include \"engine/base/a.hpp\"\n"}});
        CHECK(forbidden_includes(tree).size() == 5);
        CHECK(missing_includes(tree).empty());
        CHECK(include_cycles(tree).size() == 6);
    }
    SECTION("FCL outside collision/fcl_*, in a line of its own or through a header") {
        const SourceTree tree = tree_of({{"collision/fcl_boxes.hpp", "#include <fcl/fcl.h>\n"},
                                         {"collision/fcl_boxes.cpp", "#include \"collision/fcl_boxes.hpp\"\n"},
                                         {"collision/narrow_phase.cpp", "#include \"collision/middle.hpp\"\n"},
                                         {"collision/middle.hpp", "#include \"collision/fcl_boxes.hpp\"\n"},
                                         {"engine/world.cpp", "#include <ccd/ccd.h>\n"}});
        CHECK(fcl_leaks(tree).size() == 3);
    }
    SECTION("a file that is not there, a file that is too long") {
        const SourceTree tree = tree_of({{"solver/a.cpp", "#include \"b.hpp\"\n\n\n"}});
        CHECK(missing_includes(tree).size() == 1);
        CHECK(oversized_files(tree, 3).empty());
        CHECK(oversized_files(tree, 2).size() == 1);
    }
}
