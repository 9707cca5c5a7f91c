#include "producer/run/golden_overview.h"

#include <fmt/format.h>

#include "producer/base/markup.h"
#include "render/file_io.h"
#include "render/image_io.h"

namespace offstage::producer {
namespace {

const char* outcome_name(TestResult::Outcome outcome) {
  switch (outcome) {
    case TestResult::Outcome::passed:
      return "as recorded";
    case TestResult::Outcome::failed:
      return "differs";
    case TestResult::Outcome::error:
      break;
  }
  return "error";
}

}  // namespace

std::filesystem::path write_report_overview(const std::filesystem::path& folder,
                                            std::span<const ReportedScene> scenes) {
  std::string rows;
  for (const ReportedScene& scene : scenes) {
    const std::string name = escape_markup(scene.result.name);
    rows += fmt::format(
        "<tr class=\"{}\"><td>{}</td><td>{}</td><td>{:.1f} s</td><td>{}</td></tr>\n",
        scene.result.outcome == TestResult::Outcome::passed ? "same" : "other",
        scene.page.empty() ? name : fmt::format("<a href=\"{}\">{}</a>", escape_markup(scene.page), name),
        outcome_name(scene.result.outcome), scene.result.seconds, escape_markup(scene.result.message));
  }
  const std::string html = fmt::format(
      "<!doctype html><meta charset=\"utf-8\"><title>Scenes and their goldens</title>\n"
      "<style>body{{font:14px sans-serif}}td,th{{padding:2px 12px;text-align:left}}"
      ".other td{{background:#fdd}}</style>\n"
      "<h1>Scenes and their goldens</h1>\n"
      "<table><tr><th>scene<th>outcome<th>time<th>first difference or error</tr>\n{}</table>\n",
      rows);
  const std::filesystem::path page = folder / "index.html";
  render::create_parent_folders(page);
  render::write_file_atomically(page, {reinterpret_cast<const uint8_t*>(html.data()), html.size()});
  return page;
}

}  // namespace offstage::producer
