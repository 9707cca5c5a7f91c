#pragma once
/// Many small pictures in one: a grid with a heading at the top and a label under each picture.

#include <string>
#include <vector>

#include "render/image.h"

namespace offstage::producer {

struct SheetCell {
  std::vector<std::string> label;  ///< lines of text below the picture
  render::Image picture;           ///< empty: `fault` is shown instead
  std::string fault = {};
};

/// Draws a sheet with `columns` pictures per row. Text that is too long is shortened: the heading at its end,
/// labels at their start, because the ends of paths differ most.
render::Image contact_sheet(const std::vector<std::string>& heading, const std::vector<SheetCell>& cells,
                            int columns);

/// Throws std::invalid_argument if a sheet of this many pictures would be too large for a PNG.
void check_sheet_size(std::size_t cells, int columns, int width_px, int height_px);

/// Returns the number of columns for a series of `cells` pictures: a single row for a few pictures, otherwise
/// about as many columns as rows, with as few empty cells as possible.
int columns_for(std::size_t cells);

}  // namespace offstage::producer
