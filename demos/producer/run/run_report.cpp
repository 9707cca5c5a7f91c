#include "producer/run/run_report.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/markup.h"
#include "producer/base/time_code.h"
#include "producer/run/contact_sheet.h"
#include "render/image_io.h"

namespace offstage::producer {
namespace {

constexpr const char* kStyle = R"(<style>
body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222;background:#fafafa}
h1{margin-bottom:0}h2{margin-top:2em;border-bottom:1px solid #ddd}figure{margin:0}figcaption{color:#666;font-size:13px}
.sheet{display:grid;grid-template-columns:repeat(auto-fill,minmax(240px,1fr));gap:12px}.sheet img{width:100%;display:block}
svg{width:100%;height:auto;background:#fff;border:1px solid #ddd}svg text{font:12px system-ui,sans-serif;fill:#555}
pre{background:#fff;border:1px solid #ddd;padding:1em;overflow:auto;max-height:30em}table{border-collapse:collapse}
td,th{padding:2px 10px;text-align:left;border-bottom:1px solid #eee;font-family:ui-monospace,monospace;font-size:12px}
</style>)";

std::string base64(std::span<const uint8_t> bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (i + k < bytes.size() ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63];
  }
  return out;
}

struct Series {
  const char *name, *color;
  std::function<double(const FrameFigures&)> value;
};

/// Returns a rounded number as text; -0 becomes "0".
std::string label(double value) {
  return fmt::format("{:g}", std::abs(value) < 1e-12 ? 0.0 : value);
}

/// Returns about `count` round numbers between `low` and `high`, in equal steps.
std::vector<double> ticks(double low, double high, int count) {
  const double rough = (high - low) / count, power = std::pow(10, std::floor(std::log10(rough)));
  const double fraction = rough / power;
  const double step = power * (fraction <= 1 ? 1 : fraction <= 2 ? 2 : fraction <= 5 ? 5 : 10);
  std::vector<double> result;
  // The margin keeps the last number if a rounding error puts it slightly above `high`.
  for (double k = std::ceil(low / step); k * step <= high + 1e-6 * step; ++k) result.push_back(k * step);
  return result;
}

/// Returns a plot of some figures over the time of the film, as an inline drawing.
std::string plot(const std::string& title, const std::vector<FrameFigures>& figures,
                 const std::vector<Series>& all) {
  constexpr double kWidth = 1000, kHeight = 220, kLeft = 70, kRight = 25, kTop = 28, kBottom = 24;
  double low = 0, high = 0;
  for (const FrameFigures& f : figures)
    for (const Series& s : all) {
      low = std::min(low, s.value(f));
      high = std::max(high, s.value(f));
    }
  if (high - low < 1e-12) high = low + 1;
  const double begin = figures.front().time, end = std::max(figures.back().time, begin + 1e-9);
  const auto x = [&](double t) { return kLeft + (t - begin) / (end - begin) * (kWidth - kLeft - kRight); };
  const auto y = [&](double v) {
    return kHeight - kBottom - (v - low) / (high - low) * (kHeight - kTop - kBottom);
  };

  std::string svg = fmt::format("<svg viewBox=\"0 0 {} {}\"><text x=\"{}\" y=\"18\">{}</text>\n", kWidth,
                                kHeight, kLeft, escape_markup(title));
  for (const double v : ticks(low, high, 4)) {
    svg += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" stroke=\"#eee\"/>"
        "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>\n",
        kLeft, kWidth - kRight, y(v), kLeft - 6, y(v) + 4, label(v));
  }
  for (const double t : ticks(begin, end, 8)) {
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{} s</text>\n", x(t), kHeight - 6,
                       label(t));
  }
  double legend = kWidth - kRight;
  for (const Series& s : all) {
    svg += fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\" points=\"", s.color);
    for (const FrameFigures& f : figures) svg += fmt::format("{:.1f},{:.1f} ", x(f.time), y(s.value(f)));
    svg += "\"/>\n";
    if (all.size() == 1) continue;  // a single line needs no legend, because the title names it
    svg += fmt::format("<text x=\"{}\" y=\"18\" text-anchor=\"end\" style=\"fill:{}\">{}</text>\n", legend,
                       s.color, s.name);
    legend -= 110;
  }
  return svg + "</svg>\n";
}

std::string plots(const std::vector<FrameFigures>& figures) {
  if (figures.empty()) return "<p>No frames were drawn.</p>\n";
  std::string html;
  if (std::ranges::all_of(figures, [](const FrameFigures& f) { return f.energy.has_value(); }))
    html += plot("energy [J]", figures,
                 {{"kinetic", "#c33", [](const FrameFigures& f) { return f.energy->kinetic; }},
                  {"potential", "#36c", [](const FrameFigures& f) { return f.energy->potential; }},
                  {"elastic", "#393", [](const FrameFigures& f) { return f.energy->elastic; }},
                  {"total", "#222", [](const FrameFigures& f) {
                     return f.energy->kinetic + f.energy->potential + f.energy->elastic;
                   }}});
  const auto counts = [&](const char* title, const char* color,
                          std::function<double(const FrameFigures&)> value) {
    if (std::ranges::any_of(figures, [&](const FrameFigures& f) { return value(f) > 0; }))
      html += plot(title, figures, {{title, color, value}});
  };
  counts("contacts of bodies", "#a50", [](const FrameFigures& f) { return static_cast<double>(f.contacts); });
  counts("particles", "#07a", [](const FrameFigures& f) { return static_cast<double>(f.particles); });
  return html + plot("time per frame [ms]", figures,
                     {{"simulate", "#c33", [](const FrameFigures& f) { return f.sim_ms; }},
                      {"draw", "#36c", [](const FrameFigures& f) { return f.render_ms; }},
                      {"encode", "#393", [](const FrameFigures& f) { return f.encode_ms; }}});
}

std::string sheet(const Scene& scene, const RunStats& stats) {
  std::string html = "<div class=\"sheet\">\n";
  for (const auto& [frame, picture] : stats.pictures)
    html += fmt::format(
        "<figure><img alt=\"frame {0}\" src=\"data:image/png;base64,{1}\"><figcaption>{2}, frame "
        "{0}</figcaption></figure>\n",
        frame, base64(render::encode_png(picture)), time_code(scene.output.time_of(frame)));
  return html + "</div>\n";
}

std::string hashes(const std::vector<FrameFigures>& figures) {
  std::string html = "<table><tr><th>frame</th><th>time</th><th>state</th><th>pixels</th></tr>\n";
  for (const FrameFigures& f : figures)
    html += fmt::format("<tr><td>{}</td><td>{:.4f} s</td><td>{}</td><td>{}</td></tr>\n", f.frame, f.time,
                        f.state_hash, f.pixel_hash);
  return html + "</table>\n";
}

}  // namespace

std::string run_report(const LoadedScene& loaded, const std::string& settings, const RunStats& stats) {
  const Scene& scene = loaded.scene;
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"><title>{0}</title>\n{1}</head><body>\n"
      "<h1>{0}</h1>\n<p>{2}</p>\n<p>{3} frames of {4} x {5} pixels, {6} a second; {7} bodies, at most {8} "
      "particles; "
      "made in {9:.1f} s.</p>\n",
      escape_markup(scene.name), kStyle, escape_markup(scene.description), stats.frames,
      scene.render.size.x(), scene.render.size.y(), scene.output.fps.text(), stats.bodies,
      stats.most_particles, stats.wall_s);
  html += sheet(scene, stats);
  html += "<h2>Plots</h2>\n" + plots(stats.figures);
  html += "<h2>Figures</h2>\n<pre>" + escape_markup(to_json(stats)) + "</pre>\n";
  html += "<h2>Settings</h2>\n<p>Hash <code>" + settings + "</code></p>\n<pre>" +
          escape_markup(nlohmann::ordered_json::parse(loaded.canonical).dump(2)) + "</pre>\n";
  html += "<h2>Hashes</h2>\n" + hashes(stats.figures);
  return html + "</body></html>\n";
}

}  // namespace offstage::producer
