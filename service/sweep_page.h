/* Parts of the page that sweep_html() makes: each writes to `out` and leaves errors to it. The text
 * that does not change, and the style, are in www/sweep.html. */
#ifndef PELT_SERVICE_SWEEP_PAGE_H
#define PELT_SERVICE_SWEEP_PAGE_H

#include <stdio.h>

#include "renderer/sweep.h"

/* Error against time, and discretisation against quality, each an SVG element on logarithmic axes.
 * A point's figures are in its <title>. */
void sweep_chart_time(FILE *out, const struct sweep *sweep);
void sweep_chart_order(FILE *out, const struct sweep *sweep);

/* The mark of the s-th series, for the legend. */
void sweep_mark(FILE *out, size_t s);

/* The pictures with their error maps, as data: URIs; false where memory ran out. */
bool sweep_gallery(FILE *out, const struct sweep *sweep);

/* A number as people read it: three figures, with a power of ten where it is small ("5.83e-2"); an
 * en dash where it is none. */
void sweep_figure(FILE *out, double value);

/* Milliseconds, to three figures or a microsecond. */
void sweep_time(FILE *out, double ms);

/* `text` with what HTML would read as markup written as references; control characters but for
 * tab and newline become U+FFFD. */
void sweep_escape(FILE *out, const char *text);

#endif
