/** Small vectors, quaternions (scalar first) and systems of linear equations, as plain arrays. */

export const clip = (value, low, high) => Math.min(Math.max(value, low), high);

export const add = (a, b) => a.map((x, i) => x + b[i]);

export const subtract = (a, b) => a.map((x, i) => x - b[i]);

export const scale = (a, factor) => a.map((x) => x * factor);

export const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);

export const length = (a) => Math.sqrt(dot(a, a));

export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

export const conjugate = ([w, x, y, z]) => [w, -x, -y, -z];

export const multiply = ([w, x, y, z], [a, b, c, d]) => [
  w * a - x * b - y * c - z * d,
  w * b + x * a + y * d - z * c,
  w * c - x * d + y * a + z * b,
  w * d + x * c - y * b + z * a,
];

/** Return a vector of the world in the coordinates of a frame with the orientation `quaternion`. */
export function turnBack(quaternion, vector) {
  const [w, ...axis] = quaternion;
  const twice = scale(cross(vector, axis), 2);
  return add(add(vector, scale(twice, w)), cross(twice, axis));
}

/** Return the solution x of matrix · x = vector by Gaussian elimination with pivoting. */
export function solve(matrix, vector) {
  const n = vector.length;
  const rows = matrix.map((row, i) => [...row, vector[i]]);
  for (let i = 0; i < n; i++) {
    let pivot = i;
    for (let k = i + 1; k < n; k++) if (Math.abs(rows[k][i]) > Math.abs(rows[pivot][i])) pivot = k;
    [rows[i], rows[pivot]] = [rows[pivot], rows[i]];
    for (let k = i + 1; k < n; k++) {
      const factor = rows[k][i] / rows[i][i];
      for (let j = i; j <= n; j++) rows[k][j] -= factor * rows[i][j];
    }
  }
  const solution = new Array(n);
  for (let i = n - 1; i >= 0; i--) {
    let rest = rows[i][n];
    for (let j = i + 1; j < n; j++) rest -= rows[i][j] * solution[j];
    solution[i] = rest / rows[i][i];
  }
  return solution;
}
