import{a as e,c as t,d as n,f as r,g as i,h as a,i as o,l as s,m as c,n as l,o as u,p as d,r as f,s as p,t as m,u as h}from"./three.js";import{a as g,i as _,n as v,r as y,t as b}from"./spine3d.js";var x=16,S=.9,C=Math.cos(40*Math.PI/180),ee=[[0,1,3,2],[4,6,7,5],[0,4,5,1],[2,3,7,6],[0,2,6,4],[1,5,7,3]],te=[[.08,.5],[.08,-.5],[.5,0]].flatMap(([e=0,t=0])=>[[[e,t,.5],[S*e,S*t,0]],[[S*e,S*t,0],[e,t,-.5]]]);function ne(){let e=[D()];for(let t of[-1,1])e.push(M([-.62,.26*t,.18],[.36,.12,.3])),e.push(M([-.92,.2*t,.05],[.28,.34,.55])),e.push(M([-.86,.58*t,.16],[.2,.5,.22],[-.14,0,0]));return e.push(M([-1.26,0,-.22],[.6,.12,.42],[0,0,-.36])),T(e)}function re(){let e=[[.5,.22],[0,.5],[-.5,.3],[-.5,-.3],[0,-.5],[.5,-.22]],[t,n]=[-.5,.5].map(t=>e.map(([e,n])=>[e,n,t]));return T([[...k(e,-.5,e,.5),...w(n),...w(t.reverse())]])}function w([e,...t]){return t.slice(1).map((n,r)=>[e,t[r],n])}function T(e){let t=new Map,n=e.flatMap((e,n)=>e.flatMap(e=>e.map(e=>{let r=`${n} ${E(e)}`,i=t.get(r)??{index:t.size,point:e};return t.set(r,i),i.index})));return{positions:new Float32Array([...t.values()].flatMap(({point:e})=>[...e])),triangles:new Uint16Array(n),edges:new Float32Array(e.flatMap(N).flat(2)),bodyEdges:new Float32Array([...N(e[0]??[]),...te].flat(2))}}function E(e){return e.map(e=>(Math.round(e*1e5)/1e5+0).toString()).join()}function D(){let e=O(x,.5).map(([e,t])=>[Math.max(e,-.36),t]),t=Math.min(...e.map(([e])=>e)),n=Math.max(...e.map(([e])=>e))-t,r=e.map(([e,r])=>[(e-t)/n-.5,r]),i=r.map(([e,t])=>[S*e,S*t]);return[...k(r,-.5,i,0),...k(i,0,r,.5),...A(r,.5),...A(r,-.5)]}function O(e,t){return Array.from({length:e},(n,r)=>{let i=2*Math.PI*r/e;return[t*Math.cos(i),t*Math.sin(i)]})}function k(e,t,n,r){return e.flatMap((i,a)=>{let[o,s]=[j(e,a,t),j(e,a+1,t)],[c,l]=[j(n,a,r),j(n,a+1,r)];return[[o,s,l],[o,l,c]]})}function A(e,t){let n=t=>e.reduce((e,n)=>e+n[t],0)/e.length,r=[n(0),n(1),t];return e.map((n,i)=>{let[a,o]=[j(e,i,t),j(e,i+1,t)];return t>0?[r,a,o]:[o,a,r]})}function j(e,t,n){let[r,i]=e[t%e.length]??[0,0];return[r,i,n]}function M(e,t,n=[0,0,0]){let r=Array.from({length:8},(r,i)=>{let a=[i&4?.5:-.5,i&2?.5:-.5,i&1?.5:-.5],o=e[1]===0?a[0]<0:a[1]*e[1]>0;return[0,1,2].map(r=>(e[r]??0)+(a[r]??0)*(t[r]??0)+(o?n[r]??0:0))});return ee.flatMap(t=>{let[n,i,a,o]=t.map(t=>r[t]??e);return[[n,i,a],[n,a,o]]})}function ie([e,t,n]){return g(v(_(t,e),_(n,e)))}function N(e){let t=new Map;for(let n of e)for(let[e,r]of[[0,1],[1,2],[2,0]]){let i=[n[e],n[r]],a=i.map(E).sort().join(` `),o=t.get(a)??{edge:i,normals:[]};o.normals.push(ie(n)),t.set(a,o)}return[...t.values()].filter(({normals:[e,t]})=>e===void 0||t===void 0||e[0]*t[0]+e[1]*t[1]+e[2]*t[2]<C).map(({edge:e})=>e)}var P=`
float light(vec3 n) {
  return 0.42 + 0.13 * (0.5 + 0.5 * n.y) + 0.5 * max(dot(n, normalize(vec3(-0.35, 0.55, 0.76))), 0.0);
}`,ae=`
attribute vec4 colour;
varying vec4 shade;
${P}
void main() {
  // Normals of a shape that is scaled by different factors along its axes: divide by their squares.
  mat3 m = mat3(instanceMatrix);
  vec3 squares = vec3(dot(m[0], m[0]), dot(m[1], m[1]), dot(m[2], m[2]));
  vec3 n = normalize(mat3(viewMatrix) * (m * (normal / squares)));
  shade = vec4(colour.rgb * light(n), colour.a);
  gl_Position = projectionMatrix * (viewMatrix * (instanceMatrix * vec4(position, 1.0)));
}`,oe=`
varying vec4 shade;
void main() {
  gl_FragColor = shade;
}`,se=`
attribute vec4 colour;
varying vec4 paint;
varying vec3 place;
void main() {
  vec4 seen = viewMatrix * (instanceMatrix * vec4(position, 1.0));
  paint = colour;
  // near zero, where numbers on the graphics processor are finest
  place = seen.xyz + vec3(0.0, 0.0, MIDDLE);
  gl_Position = projectionMatrix * seen;
}`,ce=`
varying vec4 paint;
varying vec3 place;
${P}
void main() {
  vec3 n = normalize(cross(dFdx(place), dFdy(place)));
  gl_FragColor = vec4(paint.rgb * light(n), paint.a);
}`,F=`
attribute vec3 from;
attribute vec3 to;
attribute float start;
attribute vec4 colour;
attribute vec2 dash;
uniform vec2 screen;
uniform float pxPerMm;
varying vec3 tint;
varying vec2 pattern;
varying float along;
void main() {
  vec4 a = vec4(from, 1.0);
  vec4 b = vec4(to, 1.0);
  #ifdef USE_INSTANCING
  a = instanceMatrix * a;
  b = instanceMatrix * b;
  #endif
  a = modelViewMatrix * a;
  b = modelViewMatrix * b;
  float size = distance(a.xyz, b.xyz);
  // Outlines lie on the surfaces that they outline: bring them before these.
  a.z += 0.8;
  b.z += 0.8;
  vec4 p = projectionMatrix * a;
  vec4 q = projectionMatrix * b;
  vec2 way = (q.xy - p.xy) * screen;
  float onScreen = length(way);
  vec2 direction = onScreen > 1e-4 ? way / onScreen : vec2(1.0, 0.0);
  vec2 side = vec2(-direction.y, direction.x);
  // position.x is 0 or 1 along the line, position.y is -1 or 1 across it; ends are half a width longer.
  float end = position.x * 2.0 - 1.0;
  vec2 shift = (side * position.y + direction * end * 0.5) * colour.a / screen;
  gl_Position = mix(p, q, position.x);
  gl_Position.xy += shift * gl_Position.w;
  tint = colour.rgb;
  pattern = dash;
  along = (start + position.x * size) * pxPerMm;
}`,I=`
varying vec3 tint;
varying vec2 pattern;
varying float along;
void main() {
  if (pattern.y > 0.0 && mod(along, pattern.x + pattern.y) > pattern.x) discard;
  gl_FragColor = vec4(tint, 1.0);
}`,L=5e3;function R(e,t=!1){return new c({vertexShader:e===`flat`?se:ae,fragmentShader:e===`flat`?ce:oe,defines:{MIDDLE:L.toFixed(1)},transparent:t,depthWrite:!t})}function z(){return{screen:{value:new i(1,1)},pxPerMm:{value:1}}}function B(e,t){return new c({vertexShader:F,fragmentShader:I,uniforms:e,side:2,depthTest:t,depthWrite:t,transparent:!t})}var V=class{shape;mesh;constructor(e,t,n){this.shape=e,this.mesh=K(e,t,n)}set(e){let t=q(this.mesh,this.shape,e.length,[[`colour`,4]]).colour;e.forEach(({matrix:e,colour:n,opacity:r},i)=>{this.mesh.instanceMatrix.array.set(e,16*i),t?.array.set([...n,r],4*i)}),J(this.mesh,e.length)}},H=class{mesh;shape;constructor(e,t,n,r){this.shape=le(e,t),this.mesh=K(this.shape,n,r)}set(e){let{colour:t,dash:n}=q(this.mesh,this.shape,e.length,[[`colour`,4],[`dash`,2]]);e.forEach(({matrix:e,colour:r,dash:i,widthPx:a},o)=>{this.mesh.instanceMatrix.array.set(e,16*o),t?.array.set([...r,a],4*o),n?.array.set(i,2*o)}),J(this.mesh,e.length)}},U=class{mesh;capacity=0;constructor(e,r){this.mesh=new n(new t,e),this.mesh.frustumCulled=!1,this.mesh.renderOrder=r,this.mesh.visible=!1}set(e){e.length>this.capacity&&this.grow(e.length);let{from:t,to:n,start:r,colour:i,dash:a}=this.mesh.geometry.attributes;e.forEach((e,o)=>{t?.array.set(e.from,3*o),n?.array.set(e.to,3*o),r?.array.set([e.start],o),i?.array.set([...e.colour,e.widthPx],4*o),a?.array.set(e.dash,2*o)});for(let e of[t,n,r,i,a])e&&(e.needsUpdate=!0);this.mesh.geometry.instanceCount=e.length,this.mesh.visible=e.length>0}grow(e){this.capacity=2*e,this.mesh.geometry.dispose();let n=new t;n.setAttribute(`position`,new l(W,3)),n.setIndex([0,1,2,2,1,3]);for(let[e,t]of[[`from`,3],[`to`,3],[`start`,1],[`colour`,4],[`dash`,2]])n.setAttribute(e,new p(new Float32Array(t*this.capacity),t));this.mesh.geometry=n}},W=new Float32Array([0,-1,0,0,1,0,1,-1,0,1,1,0]);function G({positions:e,triangles:t}){let n=new f;return n.setAttribute(`position`,new l(e,3)),n.setIndex(new l(t,1)),n}function le(e,t){let n=e.length/6,[r,i,a,o]=[12,12,12,4].map(e=>new Float32Array(e*n)),s=[],c=0;for(let l=0;l<n;l+=1){r.set(W,12*l);for(let t=0;t<4;t+=1)i.set(e.subarray(6*l,6*l+3),12*l+3*t),a.set(e.subarray(6*l+3,6*l+6),12*l+3*t),o[4*l+t]=c;c+=t(e.subarray(6*l,6*l+6)),s.push(...[0,1,2,2,1,3].map(e=>4*l+e))}let u=new f;return u.setAttribute(`position`,new l(r,3)),u.setAttribute(`from`,new l(i,3)),u.setAttribute(`to`,new l(a,3)),u.setAttribute(`start`,new l(o,1)),u.setIndex(s),u}function K(e,t,n){let r=new s(e,t,0);return r.frustumCulled=!1,r.renderOrder=n,r.visible=!1,r}function q(e,t,n,r){if(n>e.instanceMatrix.count){let i=2*n,a=new f().copy(t);for(let[e,n]of Object.entries(t.attributes))a.setAttribute(e,n);t.index&&a.setIndex(t.index);for(let[e,t]of r){let n=new p(new Float32Array(t*i),t);a.setAttribute(e,n.setUsage(u))}e.geometry=a,e.instanceMatrix=new p(new Float32Array(16*i),16).setUsage(u)}let i=r.map(([t])=>[t,e.geometry.attributes[t]]);return Object.fromEntries(i)}function J(e,t){e.count=t,e.visible=t>0,e.instanceMatrix.needsUpdate=!0;for(let t of Object.values(e.geometry.attributes))t instanceof p&&(t.needsUpdate=!0)}var Y=2,ue=85e5,de=26e5,fe=30,pe=15,me=180,X=[1,.75,.5];function Z(e,t){let n=Math.sqrt(ue/Math.max(1,e.width*e.height));return Math.min(Y,t,n)}function Q(e,t,n){let r=Z(e,t);return n?r:Math.max(r,Math.min(Y,Math.sqrt(de/Math.max(1,e.width*e.height))))}function he(e,t){return t>fe?Math.min(X.length-1,e+1):t<pe?Math.max(0,e-1):e}var ge=class{isSmoothed;whenAtRest;step=0;lastMs=0;isMoving=!1;timer;constructor(e,t){this.isSmoothed=e,this.whenAtRest=t}moved(){this.isMoving=!0,clearTimeout(this.timer),this.timer=setTimeout(()=>{this.isMoving=!1,this.lastMs=0,this.whenAtRest()},me)}ratio(e,t){let n=performance.now();return this.isMoving&&this.lastMs>0&&(this.step=he(this.step,n-this.lastMs)),this.lastMs=this.isMoving?n:0,this.isMoving?Z(e,t)*(X[this.step]??1):Q(e,t,this.isSmoothed)}stop(){clearTimeout(this.timer)}};function _e(){let e=document.createElement(`canvas`).getContext(`webgl2`),t=e?.getExtension(`WEBGL_debug_renderer_info`),n=t?e?.getParameter(t.UNMASKED_RENDERER_WEBGL):``;return e?.getExtension(`WEBGL_lose_context`)?.loseContext(),/swiftshader|llvmpipe|softpipe|software|basic render/i.test(String(n))}var ve=class extends Error{},ye=class{renderer;scene=new d;camera=new r;lines=z();resolution;parts;plan;frame=0;screen={width:1,height:1};view=null;drawn={width:0,height:0,ratio:0};planShiftMm=0;constructor(t){o.enabled=!1;let n=!_e(),r=t.getContext(`webgl2`,{antialias:n,alpha:!0,powerPreference:`low-power`});if(r===null)throw new ve(`this browser has no WebGL 2`);this.renderer=new m({canvas:t,context:r}),this.renderer.outputColorSpace=h,this.renderer.setClearColor(0,0),this.camera.matrixAutoUpdate=!1,this.resolution=new ge(n,()=>this.invalidate());let[i,s,c]=[R(`flat`),R(`flat`,!0),R(`round`)],[l,u]=[B(this.lines,!0),B(this.lines,!1)],d=R(`round`,!0);d.depthTest=!1;let f=ne(),p=G(f),g=e=>Math.hypot(...[28,38,22].map((t,n)=>t*((e[n+3]??0)-(e[n]??0)))),_=e=>12*Math.hypot((e[3]??0)-(e[0]??0),(e[4]??0)-(e[1]??0)),v=new e(1,1,10).rotateX(Math.PI/2).translate(0,0,.5),y={vertebrae:new $(new V(p,i,0),new V(p,s,3)),simpleBodies:new V(G(re()),i,0),outlines:new H(f.edges,g,l,1),bodyOutlines:new H(f.bodyEdges,g,l,1),segments:new U(l,1),curves:new U(u,5),cones:new V(v,c,0),balls:new V(new a(1,14,10),c,0),ellipsoids:new V(new a(1,24,16),d,6),circles:new H(be(48),_,u,7),planOutlines:new H(f.bodyEdges,g,l,1),planSegments:new U(l,1)};this.parts=y,this.plan=[y.planOutlines,y.planSegments];for(let e of Object.values(y))e instanceof $?this.scene.add(e.opaque.mesh,e.seeThrough.mesh):this.scene.add(e.mesh)}setContent(e){for(let[t,n]of Object.entries(this.parts))n.set(e[t]);this.resolution.moved(),this.invalidate()}setView(e,t=0){this.view=e,this.planShiftMm=t,this.resolution.moved(),this.invalidate()}setSize(e){this.screen=e,this.resolution.moved(),this.invalidate()}invalidate(){this.frame||=requestAnimationFrame(()=>{this.frame=0,this.draw()})}draw(){let{view:e,screen:t}=this;if(e===null||t.width<2||t.height<2)return;let n=this.resolution.ratio(t,devicePixelRatio);this.resize(t,n),this.lines.screen.value.set(t.width,t.height),this.lines.pxPerMm.value=t.height/e.height,this.look(e,t),this.renderer.render(this.scene,this.camera)}dispose(){cancelAnimationFrame(this.frame),this.resolution.stop(),this.scene.traverse(e=>{if(!(`geometry`in e))return;let{geometry:t,material:n}=e;t.dispose(),n.dispose()}),this.renderer.dispose()}resize(e,t){let{width:n,height:r,ratio:i}=this.drawn;(n!==e.width||r!==e.height||t!==i)&&(this.drawn={...e,ratio:t},this.renderer.setPixelRatio(t),this.renderer.setSize(e.width,e.height,!1))}look(e,t){let{right:n,up:r,toward:i}=b(e),a=e.centre.map((e,t)=>e+L*(i[t]??0));this.camera.matrix.set(n[0],r[0],i[0],a[0],n[1],r[1],i[1],a[1],n[2],r[2],i[2],a[2],0,0,0,1),this.camera.matrixWorldNeedsUpdate=!0;let o=e.height/2,s=o*t.width/t.height;Object.assign(this.camera,{left:-s,right:s,top:o,bottom:-o,near:0,far:2*L}),this.camera.updateProjectionMatrix();let c=y(n,this.planShiftMm);for(let e of this.plan)e.mesh.position.set(...c)}},$=class{opaque;seeThrough;constructor(e,t){this.opaque=e,this.seeThrough=t}set(e){this.opaque.set(e.filter(({opacity:e})=>e>=1)),this.seeThrough.set(e.filter(({opacity:e})=>e<1))}};function be(e){let t=t=>{let n=2*Math.PI*t/e;return[Math.cos(n),Math.sin(n),0]};return new Float32Array(Array.from({length:e},(e,n)=>[...t(n),...t(n+1)]).flat())}export{ye as SpineViewer};