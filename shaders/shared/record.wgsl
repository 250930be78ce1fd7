// What classify leaves of a brick; `BrickRecord` in src/stage/classify/mod.rs.
//
// rows[y + 8 z]: bits 0-7 the crossed +x edges of the row's eight points, 8-15 its +y edges, 16-23
// its +z edges; bits 24-31 the vertices of the plane's earlier rows (at most 7 * 24 = 168).
// planes[z]: low half the vertices of the earlier planes, high half their triangles.
// triangles[(y + 8 z) / 2]: two rows a word; bits 0-10 of a half triangles of the plane's earlier rows (at most 7 * 8 * 14),
// bits 11-15 vertices within the row's own cells (at most 8 * 2). These lie behind all others of the brick, the first one last.
struct BrickRecord {
    rows: array<u32, 64>,
    planes: array<u32, 8>,
    triangles: array<u32, 32>,
}
