#pragma once
/// Many small pictures in one: a grid with a heading at the top and a label under each picture.

#include <string>
#include <vector>

#include "render/image.h"

namespace offstage::producer {

struct SheetCell {
  std::vector<std::string> label;  ///< lines of text below the picture
  render::Image picture;           ///< picture of the cell; empty: `fault` is shown instead
  std::string fault = {};          ///< text in place of a missing picture
};

/// Draws a sheet with `columns` pictures per row. Text that is too long is shortened. The heading loses its
/// end. Labels lose their start, because labels are often paths, which differ at their ends.
render::Image contact_sheet(const std::vector<std::string>& heading, const std::vector<SheetCell>& cells,
                            int columns);

/// Throws std::invalid_argument if a sheet of this many pictures would be too large for a PNG.
void check_sheet_size(std::size_t cells, int columns, int width_px, int height_px);

/// Returns a suitable number of columns for a sheet of `cells` pictures. A few pictures form a single row.
/// Otherwise there are about as many columns as rows, and as few empty cells as possible.
int columns_for(std::size_t cells);

}  // namespace offstage::producer
