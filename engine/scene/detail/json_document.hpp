// JSON text to a document, with what a scene's author must be told of: line and column of a syntax error, keys given twice.
#pragma once

#include "engine/scene/detail/mistakes.hpp"

#include <nlohmann/json.hpp>

#include <string>

namespace cairn::scene_detail {

using Json = nlohmann::json;

// Parses `text` into `document`. Notes each key given twice in one object, and the first syntax error with line and column (from 1, in
// bytes). Returns false after a syntax error; the document is then what stood before it and must not be used.
bool parse_json(const std::string& text, Mistakes& mistakes, Json& document);

}  // namespace cairn::scene_detail
