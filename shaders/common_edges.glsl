/* On which side of an edge a ray passes. After common_frame.glsl and common_real.glsl. */

/* The two functions that vanish on the ray: X - x W and Y - y W. */
void across_ray(REAL2 p, out REAL4 rx, out REAL4 ry) {
    bool orthographic = frame[FRAME_MATERIAL].w != 0.0;
    REAL4 w = orthographic ? REAL4(0.0, 0.0, 0.0, 1.0) : FRAME_REAL(FRAME_H_ROW, 8);
    rx = FRAME_REAL(FRAME_X_ROW, 6) - p.x * w;
    ry = FRAME_REAL(FRAME_Y_ROW, 7) - p.y * w;
}

/* The side of edge ab on which the ray passes: its value, and its sign with ties broken as if the
 * ray were shifted by (epsilon, epsilon^2), which all cells agree on (Edelsbrunner & Muecke 1990). */
REAL edge_function(REAL2 a, REAL2 b, out bool positive) {
    precise REAL e = a.x * b.y - b.x * a.y;
    REAL2 d = b - a;
    positive = e != 0.0 ? e > 0.0 : d.y != 0.0 ? d.y > 0.0 : d.x < 0.0;
    return e;
}
