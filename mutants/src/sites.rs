//! The places of a source where a mutant can stand, and the mutants there: the operators of cargo-mutants.

use crate::modules::is_off;
use crate::values;
use quote::ToTokens;
use std::ops::Range;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{BinOp, Block, Expr, UnOp};

/// Bytes of a file.
pub type Bytes = Range<usize>;

/// The mutant of a place: what it does, and where it stands in the file.
#[derive(Clone, Debug)]
pub struct Found {
    pub line: usize,
    pub column: usize,
    /// The function, with its type; empty outside of one.
    pub function: String,
    /// "replace + with -", as cargo-mutants says it.
    pub what: String,
    /// In a `const fn`: if it runs only while compiling, no test reaches it.
    pub early: bool,
}

/// The shape of a place, which determines what is written there.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A body after its brace: the values returned.
    Body(Vec<String>),
    /// Two operands and the text between them; other operators.
    Operator { right: usize, own: String, others: Vec<&'static str> },
    /// `&&` or `||`.
    Lazy { right: usize, and: bool },
    /// A place and what is added to it, or the like.
    Assignment { right: usize, own: String, others: Vec<&'static str> },
    /// An operator before its operand, deleted.
    Sign { operand: usize },
    /// An arm of a `match`, deleted; behind its pattern.
    Arm,
    /// A guard, true or false; the arm deleted too where there are three.
    Guard,
    /// The fields of a structure with a base: each field's name, whether it is written short, its value.
    Fields { base: Bytes, fields: Vec<(String, bool, Bytes)> },
}

/// A place: its bytes, the end of its left operand if it has one, its shape, and its mutants; `fixed` if it is compiled before a mutant could be
/// chosen: in a constant, a type, a length.
#[derive(Clone, Debug)]
pub struct Site {
    pub bytes: Bytes,
    pub left: usize,
    pub shape: Shape,
    pub fixed: bool,
    pub mutants: Vec<Found>,
}

/// All sites of a file, outer ones before the ones inside them.
pub fn of(source: &str) -> syn::Result<Vec<Site>> {
    let file = syn::parse_file(source)?;
    let mut finder = Finder::default();
    finder.visit_file(&file);
    Ok(finder.sites)
}

#[derive(Default)]
struct Finder {
    sites: Vec<Site>,
    /// Modules, types and functions around.
    around: Vec<String>,
    /// Depth of constants around.
    fixed: usize,
    /// In a `const fn`.
    early: bool,
}

impl Finder {
    fn add(&mut self, at: &impl Spanned, bytes: Bytes, left: usize, shape: Shape, whats: Vec<String>) {
        let start = at.span().start();
        let function = self.around.join("::");
        let (line, column, early) = (start.line, start.column + 1, self.early);
        let found = |what| Found { line, column, function: function.clone(), what, early };
        let mutants: Vec<_> = whats.into_iter().map(found).collect();
        let fixed = self.fixed > 0;
        if !mutants.is_empty() {
            self.sites.push(Site { bytes, left, shape, fixed, mutants });
        }
    }

    fn within(&mut self, name: String, visit: impl FnOnce(&mut Self)) {
        self.around.push(name);
        visit(self);
        self.around.pop();
    }

    fn constant(&mut self, visit: impl FnOnce(&mut Self)) {
        self.fixed += 1;
        visit(self);
        self.fixed -= 1;
    }

    fn named_constant(&mut self, attributes: &[syn::Attribute], name: &syn::Ident, value: &syn::Expr) {
        if !is_off(attributes) {
            self.within(name.to_string(), |finder| finder.constant(|finder| finder.visit_expr(value)));
        }
    }

    fn function(&mut self, signature: &syn::Signature, block: &Block) {
        let fixed = std::mem::take(&mut self.fixed);
        let early = std::mem::replace(&mut self.early, signature.constness.is_some());
        self.within(signature.ident.to_string(), |finder| {
            let unit = matches!(signature.output, syn::ReturnType::Default);
            let is_default = signature.ident == "default" && signature.inputs.is_empty();
            if !(unit && block.stmts.is_empty()) && signature.unsafety.is_none() && !is_default {
                let values: Vec<_> = values::of(&signature.output);
                let own = block.stmts.iter().map(|statement| statement.to_token_stream().to_string());
                let own: String = own.collect();
                let squeezed = |text: &str| text.replace(' ', "");
                let values: Vec<_> =
                    values.into_iter().filter(|value| squeezed(value) != squeezed(&own)).collect();
                let whats = values
                    .iter()
                    .map(|value| format!("replace with {}", value.replace("::mutant::", "")))
                    .collect();
                let behind = block.brace_token.span.open().byte_range().end;
                finder.add(&signature.ident, behind..behind, behind, Shape::Body(values), whats);
            }
            finder.visit_block(block);
        });
        (self.fixed, self.early) = (fixed, early);
    }

    fn binary(&mut self, binary: &syn::ExprBinary) {
        let others = others(&binary.op);
        let (left, right) = (bytes(&binary.left), bytes(&binary.right));
        let own = binary.op.to_token_stream().to_string();
        let place = left.start..right.end;
        let whats = others.iter().map(|other| format!("replace {own} with {other}")).collect();
        let right = right.start;
        let shape = match binary.op {
            BinOp::And(_) | BinOp::Or(_) if has_let(&binary.left) || has_let(&binary.right) => return,
            BinOp::And(_) | BinOp::Or(_) => Shape::Lazy { right, and: matches!(binary.op, BinOp::And(_)) },
            op if assigns(&op) => Shape::Assignment { right, own, others },
            _ => Shape::Operator { right, own, others },
        };
        self.add(&binary.op, place, left.end, shape, whats);
    }

    fn arms(&mut self, matched: &syn::ExprMatch) {
        let is_wild = |arm: &syn::Arm| matches!(arm.pat, syn::Pat::Wild(_)) && arm.guard.is_none();
        let has_wild = matched.arms.iter().any(is_wild);
        for arm in matched.arms.iter().filter(|arm| !is_wild(arm) && !is_off(&arm.attrs)) {
            let pattern = arm.pat.to_token_stream().to_string();
            let delete = has_wild.then(|| format!("delete match arm {pattern}"));
            match &arm.guard {
                None => {
                    let end = bytes(&arm.pat).end;
                    self.add(&arm.pat, end..end, end, Shape::Arm, delete.into_iter().collect());
                }
                Some((_, guard)) if has_let(guard) => {}
                Some((_, guard)) => {
                    let text = guard.to_token_stream();
                    let constants =
                        [true, false].map(|value| format!("replace match guard {text} with {value}"));
                    let whats = constants.into_iter().chain(delete).collect();
                    let place = bytes(guard);
                    self.add(guard, place.clone(), place.end, Shape::Guard, whats);
                }
            }
        }
    }

    fn fields(&mut self, structure: &syn::ExprStruct) {
        let Some(base) = &structure.rest else { return };
        let name = |field: &syn::FieldValue| field.member.to_token_stream().to_string();
        let fields: Vec<_> = structure
            .fields
            .iter()
            .map(|field| (name(field), field.colon_token.is_none(), bytes(&field.expr)))
            .collect();
        let path = structure.path.to_token_stream();
        let whats = fields
            .iter()
            .map(|(name, ..)| format!("delete field {name} from struct {path} expression"))
            .collect();
        let (place, end) = (bytes(structure), bytes(&structure.path).end);
        self.add(structure, place, end, Shape::Fields { base: bytes(base), fields }, whats);
    }
}

impl<'ast> Visit<'ast> for Finder {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_off(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_impl(&mut self, item: &'ast syn::ItemImpl) {
        let ty = item.self_ty.to_token_stream().to_string().replace(' ', "");
        let of =
            item.trait_.as_ref().map(|(_, path, _)| path.segments.last().map(|last| last.ident.to_string()));
        let printed =
            matches!(of.as_ref().and_then(|name| name.as_deref()), Some("Debug" | "Display" | "Format"));
        if is_off(&item.attrs) || printed {
            return;
        }
        let name = of.flatten().map_or(ty.clone(), |name| format!("<{name} for {ty}>"));
        self.within(name, |finder| visit::visit_item_impl(finder, item));
    }

    fn visit_item_trait(&mut self, item: &'ast syn::ItemTrait) {
        self.within(item.ident.to_string(), |finder| visit::visit_item_trait(finder, item));
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        if !is_off(&item.attrs) {
            self.function(&item.sig, &item.block);
        }
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        if !is_off(&item.attrs) {
            self.function(&item.sig, &item.block);
        }
    }

    fn visit_trait_item_fn(&mut self, item: &'ast syn::TraitItemFn) {
        if let Some(block) = &item.default {
            self.function(&item.sig, block);
        }
    }

    fn visit_item_const(&mut self, item: &'ast syn::ItemConst) {
        self.named_constant(&item.attrs, &item.ident, &item.expr);
    }

    fn visit_item_static(&mut self, item: &'ast syn::ItemStatic) {
        self.named_constant(&item.attrs, &item.ident, &item.expr);
    }

    fn visit_impl_item_const(&mut self, item: &'ast syn::ImplItemConst) {
        self.named_constant(&item.attrs, &item.ident, &item.expr);
    }

    fn visit_trait_item_const(&mut self, item: &'ast syn::TraitItemConst) {
        self.constant(|finder| visit::visit_trait_item_const(finder, item));
    }

    fn visit_variant(&mut self, variant: &'ast syn::Variant) {
        self.constant(|finder| visit::visit_variant(finder, variant));
    }

    fn visit_expr_const(&mut self, expr: &'ast syn::ExprConst) {
        self.constant(|finder| visit::visit_expr_const(finder, expr));
    }

    fn visit_type(&mut self, _: &'ast syn::Type) {}

    fn visit_pat(&mut self, _: &'ast syn::Pat) {}

    fn visit_generic_argument(&mut self, _: &'ast syn::GenericArgument) {}

    fn visit_expr_repeat(&mut self, expr: &'ast syn::ExprRepeat) {
        self.visit_expr(&expr.expr);
        self.constant(|finder| finder.visit_expr(&expr.len));
    }

    fn visit_expr_match(&mut self, matched: &'ast syn::ExprMatch) {
        self.arms(matched);
        visit::visit_expr_match(self, matched);
    }

    fn visit_arm(&mut self, arm: &'ast syn::Arm) {
        if !is_off(&arm.attrs) {
            visit::visit_arm(self, arm);
        }
    }

    /// The base is written twice, as it is.
    fn visit_expr_struct(&mut self, structure: &'ast syn::ExprStruct) {
        self.fields(structure);
        structure.fields.iter().for_each(|field| self.visit_field_value(field));
        self.constant(|finder| structure.rest.iter().for_each(|base| finder.visit_expr(base)));
    }

    /// The place of an assignment is written for each mutant, unchanged.
    fn visit_expr_binary(&mut self, binary: &'ast syn::ExprBinary) {
        self.binary(binary);
        self.fixed += usize::from(assigns(&binary.op));
        self.visit_expr(&binary.left);
        self.fixed -= usize::from(assigns(&binary.op));
        self.visit_expr(&binary.right);
    }

    fn visit_expr_unary(&mut self, unary: &'ast syn::ExprUnary) {
        if matches!(unary.op, UnOp::Neg(_) | UnOp::Not(_)) {
            let what = format!("delete {}", unary.op.to_token_stream());
            let (place, operand) = (bytes(unary), bytes(&*unary.expr).start);
            self.add(unary, place.clone(), place.start, Shape::Sign { operand }, vec![what]);
        }
        visit::visit_expr_unary(self, unary);
    }
}

fn bytes(of: &impl Spanned) -> Bytes {
    of.span().byte_range()
}

/// A `let` among conditions: no value, so no part of a mutant.
fn has_let(expr: &Expr) -> bool {
    match expr {
        Expr::Let(_) => true,
        Expr::Binary(binary) => has_let(&binary.left) || has_let(&binary.right),
        _ => false,
    }
}

/// `+=` and the like.
fn assigns(op: &BinOp) -> bool {
    let text = op.to_token_stream().to_string();
    text.ends_with('=') && !matches!(text.as_str(), "==" | "!=" | "<=" | ">=")
}

/// The operators in place of one.
fn others(op: &BinOp) -> Vec<&'static str> {
    let others: &[&str] = match op {
        BinOp::Eq(_) => &["!="],
        BinOp::Ne(_) => &["=="],
        BinOp::And(_) => &["||"],
        BinOp::Or(_) => &["&&"],
        BinOp::Lt(_) => &["==", ">", "<="],
        BinOp::Gt(_) => &["==", "<", ">="],
        BinOp::Le(_) => &[">"],
        BinOp::Ge(_) => &["<"],
        BinOp::Add(_) => &["-", "*"],
        BinOp::Sub(_) => &["+", "/"],
        BinOp::Mul(_) => &["+", "/"],
        BinOp::Div(_) => &["%", "*"],
        BinOp::Rem(_) => &["/", "+"],
        BinOp::Shl(_) => &[">>"],
        BinOp::Shr(_) => &["<<"],
        BinOp::BitAnd(_) => &["|", "^"],
        BinOp::BitOr(_) => &["&", "^"],
        BinOp::BitXor(_) => &["|", "&"],
        BinOp::AddAssign(_) => &["-=", "*="],
        BinOp::SubAssign(_) => &["+=", "/="],
        BinOp::MulAssign(_) => &["+=", "/="],
        BinOp::DivAssign(_) => &["%=", "*="],
        BinOp::RemAssign(_) => &["/=", "+="],
        BinOp::BitAndAssign(_) => &["|=", "^="],
        BinOp::BitOrAssign(_) => &["&=", "^="],
        BinOp::BitXorAssign(_) => &["|=", "&="],
        BinOp::ShlAssign(_) => &[">>="],
        BinOp::ShrAssign(_) => &["<<="],
        _ => &[],
    };
    others.to_vec()
}
