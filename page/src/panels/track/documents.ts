/** What the service knows of the selected track beyond the picture. */

export interface TrackPlot {
  time_s: number;
  sensor_id: string;
  kind: "radar" | "position" | "bearing";
  range_m: number | null;
  azimuth_deg: number | null;
  height_m: number | null;
  range_bias_m: number | null;
  azimuth_bias_deg: number | null;
  innovation_range_m: number | null;
  innovation_azimuth_deg: number | null;
  innovation_east_m: number | null;
  innovation_north_m: number | null;
  nis: number | null;
  degrees_of_freedom: number;
  weight: number | null;
  residual_east_m: number | null;
  residual_north_m: number | null;
}

export interface TrackPlots {
  time_s: number;
  plots: TrackPlot[];
}

export interface Transition {
  time_s: number;
  transition: string;
  reason: string;
  into_track_id: number | null;
}

/** Normalised innovation: about 1 where all is as configured; null for the first plot. */
export function sigmasOf(plot: TrackPlot): number | null {
  return plot.nis === null ? null : Math.sqrt(plot.nis / plot.degrees_of_freedom);
}

/** Distance from the track after the update, m; NaN for bearings. */
export function residualOf(plot: TrackPlot): number {
  return plot.residual_east_m === null || plot.residual_north_m === null ? NaN : Math.hypot(plot.residual_east_m, plot.residual_north_m);
}

/** Innovation along the line of sight, or to the east, m. */
export function alongOf(plot: TrackPlot): number | null {
  return plot.innovation_range_m ?? plot.innovation_east_m;
}

/** Innovation across the line of sight, or to the north, m. */
export function acrossOf(plot: TrackPlot): number | null {
  if (plot.innovation_azimuth_deg === null) return plot.innovation_north_m;
  return plot.range_m === null ? null : (plot.innovation_azimuth_deg * Math.PI * plot.range_m) / 180;
}
