#include "producer/base/error.h"

#include "render/file_io.h"

namespace offstage {
namespace {

std::string join_lines(const std::vector<Problem>& problems) {
  std::string text;
  for (const Problem& problem : problems) {
    if (!text.empty()) text += '\n';
    text += problem.describe();
  }
  return text;
}

}  // namespace

std::string Problem::describe() const {
  std::string text = where.file;
  if (where.line > 0) text += ':' + std::to_string(where.line) + ':' + std::to_string(where.column);
  if (!text.empty()) text += ": ";
  if (!where.path.empty()) text += where.path + ": ";
  return render::escaped(text + what);
}

SceneError::SceneError(std::vector<Problem> problems)
    : std::runtime_error(join_lines(problems)), problems_(std::move(problems)) {}

}  // namespace offstage
