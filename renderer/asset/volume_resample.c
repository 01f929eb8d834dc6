/* Taps; see volume_resample.h. */
#include "renderer/asset/volume_resample.h"

#include <stddef.h>
#include <stdlib.h>

struct taps *resample_taps(int source, int target, bool periodic) {
    double ratio = (double)source / (double)target;
    size_t most = source > target ? (size_t)ratio + 2 : 2;
    struct taps *taps = calloc(1, (size_t)target * (sizeof *taps + most * sizeof(float)));
    if (!taps)
        return NULL;
    float *weights = (float *)(taps + target);
    for (int i = 0; i < target; i++, weights += most) {
        taps[i].weights = weights;
        if (source > target) {
            double low = i * ratio, high = (i + 1) * ratio;
            taps[i].first = (int)low;
            for (int j = taps[i].first; j < high && taps[i].count < (int)most; j++) {
                double part = fmin(j + 1.0, high) - fmax(j, low);
                weights[taps[i].count++] = (float)(part / ratio);
            }
        } else {
            double at = (i + 0.5) * ratio - 0.5, whole = floor(at);
            bool before = whole < 0, last = !periodic && whole >= source - 1;
            taps[i].first = before ? (periodic ? source - 1 : 0) : (int)whole;
            taps[i].count = (before && !periodic) || last ? 1 : 2;
            weights[0] = taps[i].count == 1 ? 1.0f : (float)(1.0 - (at - whole));
            weights[1] = (float)(at - whole);
        }
    }
    return taps;
}
